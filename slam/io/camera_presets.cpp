#include "slam/io/camera_presets.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "slam/util/data_path.h"
#include "slam/util/error.h"
#include "slam/util/options.h"

namespace sqslam {
namespace fs = std::filesystem;

std::vector<std::string> CameraPresetNames() {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(DataPath("configs/cameras"))) {
    if (entry.path().extension() == ".yaml") {
      names.push_back(entry.path().stem().string());
    }
  }
  std::sort(names.begin(), names.end());
  return names;
}

fs::path CameraFile(const std::string& file_or_preset) {
  const fs::path path = file_or_preset;
  if (path.has_parent_path() || path.has_extension() || fs::exists(path)) {
    return path;
  }
  const std::vector<std::string> names = CameraPresetNames();
  if (std::find(names.begin(), names.end(), file_or_preset) == names.end()) {
    const std::string nearest = NearestWord(file_or_preset, names);
    throw UsageError(fmt::format(
        "--camera {}: no such file or preset{}, expected a FILE.yaml or one of {}", file_or_preset,
        nearest.empty() ? "" : fmt::format(" (did you mean {}?)", nearest), fmt::join(names, ", ")));
  }
  return DataPath(fs::path("configs") / "cameras" / (file_or_preset + ".yaml"));
}

}  // namespace sqslam
