#include "slam/io/foreign_cameras.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/LU>
#include <array>
#include <opencv2/imgcodecs.hpp>
#include <set>
#include <string>

#include "slam/io/image_files.h"
#include "slam/util/text_lines.h"
#include "slam/util/throw_if.h"

namespace sqslam {
namespace {

void CheckModel(const YAML::Node& camera, const char* key, const std::set<std::string>& known,
                const std::filesystem::path& path) {
  const YAML::Node model = camera[key];
  if (model && (!model.IsScalar() || !known.contains(model.Scalar()))) {
    throw InputError("{}:{}: {} is {}, expected {}", path.string(), model.Mark().line + 1, key,
                     model.IsScalar() ? model.Scalar() : "no word", fmt::join(known, " or "));
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

void TakeModel(const YAML::Node& camera, YAML::Node& own) {
  if (camera["distortion_model"] && camera["distortion_model"].Scalar() == "equidistant") {
    own["distortion_model"] = "fisheye";
  }
}

YAML::Node FromIntrinsics(const YAML::Node& camera, const std::filesystem::path& path) {
  CheckModel(camera, "camera_model", {"pinhole"}, path);
  CheckModel(camera, "distortion_model", {"radtan", "radial-tangential", "none", "equidistant"}, path);
  YAML::Node own;
  TakeModel(camera, own);
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

// Returns the list of a matrix: its "data", or the node itself, which the reader refuses if it is no list.
YAML::Node DataOf(const YAML::Node& matrix) {
  return matrix && matrix.IsMap() && matrix["data"] ? matrix["data"] : matrix;
}

YAML::Node FromRos(const YAML::Node& camera, const std::filesystem::path& path) {
  CheckModel(camera, "distortion_model", {"plumb_bob", "equidistant"}, path);
  YAML::Node own;
  TakeModel(camera, own);
  own["width"] = camera["image_width"];
  own["height"] = camera["image_height"];
  Name(DataOf(camera["camera_matrix"]), {"fx", "", "cx", "", "fy", "cy"}, own);
  if (camera["distortion_coefficients"]) {
    own["distortion"] = DataOf(camera["distortion_coefficients"]);
  }
  return own;
}

using ProjectionMatrix = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;

ProjectionMatrix ReadKittiProjection(const std::filesystem::path& calib, int number) {
  constexpr const char* kExpected = "'P2: ' and the 12 numbers of a projection matrix";
  const std::string key = fmt::format("P{}:", number);
  for (const TextLine& line : ReadTextLines(calib, kExpected)) {
    if (line.words.front() != key) {
      continue;
    }
    if (line.words.size() != 13) {
      ThrowBadLine(calib, line, kExpected);
    }
    ProjectionMatrix p;
    for (int i = 0; i < 12; ++i) {
      p.data()[i] = NumberAt(calib, line, static_cast<std::size_t>(i) + 1, kExpected);
    }
    if (!(p(0, 0) > 0.0 && p(1, 1) > 0.0)) {
      ThrowBadLine(calib, line, "focal lengths above 0");
    }
    return p;
  }
  throw InputError("{}: no line {}, expected {}", calib.string(), key, kExpected);
}

}  // namespace

YAML::Node InOwnNames(const YAML::Node& root, const std::filesystem::path& path) {
  if (root["cam0"] && root["cam0"].IsMap()) {
    return FromIntrinsics(root["cam0"], path);
  }
  if (root["intrinsics"]) {
    return FromIntrinsics(root, path);
  }
  if (root["camera_matrix"] && root["image_width"] && root["image_height"]) {
    return FromRos(root, path);
  }
  return root;
}

Camera ReadKittiCamera(const std::filesystem::path& calib, int number, const std::filesystem::path& image,
                       double fps) {
  const ProjectionMatrix p = ReadKittiProjection(calib, number);
  const cv::Mat picture = ReadImage(image, cv::IMREAD_COLOR);
  ThrowIf<InputError>(picture.empty(), "{}: cannot be read, expected an image to take the camera's size from",
                      image.string());
  return {picture.cols, picture.rows, p(0, 0), p(1, 1), p(0, 2), p(1, 2), {}, fps};
}

Rigid3d ReadEurocExtrinsics(const std::filesystem::path& sensor) {
  constexpr const char* kExpected = "the 16 numbers of T_BS, the camera's pose in the body";
  const std::string text = ReadFile(sensor, kExpected);
  try {
    const auto numbers = YAML::Load(text)["T_BS"]["data"].as<std::array<double, 16>>();
    const Eigen::Matrix4d matrix = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>(numbers.data());
    const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>();
    if ((rotation.transpose() * rotation).isIdentity(0.01) && rotation.determinant() > 0.0) {
      return {Eigen::Quaterniond(rotation).normalized(), matrix.topRightCorner<3, 1>()};
    }
  } catch (const YAML::Exception&) {  // refused below
  }
  throw InputError("{}: no rigid motion T_BS, expected {}", sensor.string(), kExpected);
}

Rigid3d ReadKittiExtrinsics(const std::filesystem::path& calib, int number) {
  const ProjectionMatrix p = ReadKittiProjection(calib, number);
  const double z = p(2, 3);
  return {Eigen::Quaterniond::Identity(),
          {-(p(0, 3) - p(0, 2) * z) / p(0, 0), -(p(1, 3) - p(1, 2) * z) / p(1, 1), -z}};
}

}  // namespace sqslam
