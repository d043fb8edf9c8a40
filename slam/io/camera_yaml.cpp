#include "slam/io/camera_yaml.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <yaml-cpp/yaml.h>

#include <cmath>
#include <sstream>
#include <string>

#include "slam/util/atomic_file.h"
#include "slam/util/data_path.h"
#include "slam/util/error.h"
#include "slam/util/text_lines.h"

namespace sqslam {
namespace {

constexpr int kMaxImageSide = 16384;   // pixels
constexpr double kMaxReadout = 100.0;  // ms

class CameraReader {
 public:
  explicit CameraReader(const std::filesystem::path& path) : path_(path) {
    const std::string text = ReadFile(path, "a camera description with width, height, fx, fy, cx, cy");
    try {
      root_ = YAML::Load(text);
    } catch (const YAML::ParserException& e) {
      throw InputError(fmt::format("{}:{}: no valid YAML: {}", path.string(), e.mark.line + 1, e.msg));
    }
    if (!root_.IsMap()) {
      throw InputError(
          fmt::format("{}:1: expected lines 'name: value' (width, height, fx, fy, cx, cy)", path.string()));
    }
  }

  double Number(const std::string& key, double min, double max) const {
    const YAML::Node node = root_[key];
    if (!node) {
      throw InputError(fmt::format("{}: {} is missing, expected {}", path_.string(), key, Range(min, max)));
    }
    return Checked(node, key, min, max);
  }

  double Checked(const YAML::Node& node, const std::string& key, double min, double max) const {
    double value = NAN;
    if (!node.IsScalar() || !YAML::convert<double>::decode(node, value) || !(value >= min && value <= max)) {
      throw InputError(fmt::format("{}:{}: {} is {}, expected {}", path_.string(), node.Mark().line + 1, key,
                                   node.IsScalar() ? node.Scalar() : "no number", Range(min, max)));
    }
    return value;
  }

  YAML::Node Optional(const std::string& key) const { return root_[key]; }

  [[noreturn]] void Fail(const YAML::Node& node, const std::string& what) const {
    throw InputError(fmt::format("{}:{}: {}", path_.string(), node.Mark().line + 1, what));
  }

 private:
  static std::string Range(double min, double max) { return fmt::format("a number from {} to {}", min, max); }

  std::filesystem::path path_;
  YAML::Node root_;
};

}  // namespace

Camera ReadCamera(const std::filesystem::path& path) {
  const CameraReader reader(path);
  const auto side = [&](const std::string& key) {
    const double value = reader.Number(key, 1, kMaxImageSide);
    if (value != std::floor(value)) {
      reader.Fail(reader.Optional(key),
                  fmt::format("{} is {}, expected a whole number of pixels", key, value));
    }
    return static_cast<int>(value);
  };
  Camera camera;
  camera.width = side("width");
  camera.height = side("height");
  // Fields of view from 0.6 to 179 degrees: beyond that the number is a slip, not a lens.
  const double max_focal = 100.0 * std::max(camera.width, camera.height);
  camera.fx = reader.Number("fx", 0.005 * camera.width, max_focal);
  camera.fy = reader.Number("fy", 0.005 * camera.height, max_focal);
  camera.cx = reader.Number("cx", -camera.width, 2.0 * camera.width);
  camera.cy = reader.Number("cy", -camera.height, 2.0 * camera.height);
  if (const YAML::Node node = reader.Optional("distortion"); node) {
    if (!node.IsSequence() || node.size() > camera.distortion.size()) {
      reader.Fail(node, "distortion is no list of at most five numbers, expected [k1, k2, p1, p2, k3]");
    }
    for (std::size_t i = 0; i < node.size(); ++i) {
      camera.distortion[i] = reader.Checked(node[i], fmt::format("distortion[{}]", i), -1e3, 1e3);
    }
  }
  if (const YAML::Node node = reader.Optional("fps"); node) {
    camera.fps = reader.Checked(node, "fps", 0.01, 10000.0);
  }
  if (const YAML::Node node = reader.Optional("readout_ms"); node) {
    camera.readout_ms = reader.Checked(node, "readout_ms", -kMaxReadout, kMaxReadout);
  }
  return camera;
}

void WriteCamera(const std::filesystem::path& path, const Camera& camera, const std::string& comment) {
  std::string above;
  std::istringstream lines(comment);
  for (std::string line; std::getline(lines, line);) {
    above += "# " + line + "\n";
  }
  const std::string readout =
      camera.readout_ms != 0.0 ? fmt::format("readout_ms: {}\n", camera.readout_ms) : "";
  WriteFileAtomically(path, fmt::format("{}width: {}\nheight: {}\nfx: {}\nfy: {}\ncx: {}\ncy: {}\n"
                                        "distortion: [{}]  # k1 k2 p1 p2 k3\nfps: {}\n{}",
                                        above, camera.width, camera.height, camera.fx, camera.fy, camera.cx,
                                        camera.cy, fmt::join(camera.distortion, ", "), camera.fps, readout));
}

std::vector<std::string> CameraPresetNames() { return ConfigNames("configs/cameras"); }

std::filesystem::path CameraFile(const std::string& file_or_preset) {
  const std::filesystem::path path = file_or_preset;
  if (path.has_parent_path() || path.has_extension() || std::filesystem::exists(path)) {
    return path;
  }
  return ConfigFile("configs/cameras", "--camera", file_or_preset);
}

}  // namespace sqslam
