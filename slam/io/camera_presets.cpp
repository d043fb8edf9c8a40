#include "slam/io/camera_presets.h"

#include "slam/util/data_path.h"

namespace sqslam {
namespace fs = std::filesystem;

std::vector<std::string> CameraPresetNames() { return ConfigNames("configs/cameras"); }

fs::path CameraFile(const std::string& file_or_preset) {
  const fs::path path = file_or_preset;
  if (path.has_parent_path() || path.has_extension() || fs::exists(path)) {
    return path;
  }
  return ConfigFile("configs/cameras", "--camera", file_or_preset);
}

}  // namespace sqslam
