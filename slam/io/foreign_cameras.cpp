#include "slam/io/foreign_cameras.h"

#include <fmt/format.h>

#include <opencv2/imgcodecs.hpp>
#include <set>
#include <string>

#include "slam/io/image_files.h"
#include "slam/util/error.h"
#include "slam/util/text_lines.h"

namespace sqslam {
namespace {

void CheckModel(const YAML::Node& camera, const char* key, const std::set<std::string>& known,
                const std::filesystem::path& path) {
  const YAML::Node model = camera[key];
  if (model && (!model.IsScalar() || !known.contains(model.Scalar()))) {
    throw InputError("{}:{}: {} is {}, expected {}", path.string(), model.Mark().line + 1, key,
                     model.IsScalar() ? model.Scalar() : "no word", *known.begin());
  }
}

// Assigns the names to the numbers of a list in order, skipping empty names; further numbers are ignored.
void Name(const YAML::Node& list, std::initializer_list<const char*> names, YAML::Node& own) {
  if (!list || !list.IsSequence()) {
    return;
  }
  std::size_t i = 0;
  for (const char* name : names) {
    if (i < list.size() && *name != '\0') {
      own[name] = list[i];
    }
    ++i;
  }
}

YAML::Node FromIntrinsics(const YAML::Node& camera, const std::filesystem::path& path) {
  CheckModel(camera, "camera_model", {"pinhole"}, path);
  CheckModel(camera, "distortion_model", {"radtan", "radial-tangential", "none"}, path);
  YAML::Node own;
  Name(camera["resolution"], {"width", "height"}, own);
  Name(camera["intrinsics"], {"fx", "fy", "cx", "cy"}, own);
  for (const char* key : {"distortion_coeffs", "distortion_coefficients"}) {
    if (camera[key]) {
      own["distortion"] = camera[key];
    }
  }
  if (camera["rate_hz"]) {
    own["fps"] = camera["rate_hz"];
  }
  return own;
}

YAML::Node FromRos(const YAML::Node& camera, const std::filesystem::path& path) {
  CheckModel(camera, "distortion_model", {"plumb_bob"}, path);
  YAML::Node own;
  own["width"] = camera["image_width"];
  own["height"] = camera["image_height"];
  Name(camera["camera_matrix"]["data"], {"fx", "", "cx", "", "fy", "cy"}, own);
  const YAML::Node distortion = camera["distortion_coefficients"];
  if (distortion && distortion["data"]) {
    own["distortion"] = distortion["data"];
  }
  return own;
}

}  // namespace

YAML::Node InOwnNames(const YAML::Node& root, const std::filesystem::path& path) {
  if (root["cam0"] && root["cam0"].IsMap()) {
    return FromIntrinsics(root["cam0"], path);
  }
  if (root["intrinsics"]) {
    return FromIntrinsics(root, path);
  }
  if (root["camera_matrix"] && root["camera_matrix"].IsMap() && root["image_width"] && root["image_height"]) {
    return FromRos(root, path);
  }
  return root;
}

Camera ReadKittiCamera(const std::filesystem::path& calib, int number, const std::filesystem::path& image,
                       double fps) {
  constexpr const char* kExpected = "'P2: ' and the 12 numbers of a projection matrix";
  const std::string key = fmt::format("P{}:", number);
  for (const TextLine& line : ReadTextLines(calib, kExpected)) {
    if (line.words.front() != key) {
      continue;
    }
    const cv::Mat picture = ReadImage(image, cv::IMREAD_COLOR);
    if (line.words.size() != 13) {
      ThrowBadLine(calib, line, kExpected);
    }
    if (picture.empty()) {
      throw InputError("{}: cannot be read, expected an image to take the camera's size from",
                       image.string());
    }
    const auto at = [&](std::size_t word) { return NumberAt(calib, line, word, kExpected); };
    if (!(at(1) > 0.0 && at(6) > 0.0)) {
      ThrowBadLine(calib, line, "focal lengths above 0");
    }
    return {picture.cols, picture.rows, at(1), at(6), at(3), at(7), {}, fps};
  }
  throw InputError("{}: no line {}, expected {}", calib.string(), key, kExpected);
}

}  // namespace sqslam
