#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace sqslam {

// Calibrations that come with the program, configs/cameras/NAME.yaml: their names, sorted.
std::vector<std::string> CameraPresetNames();

// The file that --camera means: a file that exists, a path (with a folder or an extension) as it is, and
// otherwise the preset of that name. Throws UsageError for an unknown name, with the presets and the nearest.
std::filesystem::path CameraFile(const std::string& file_or_preset);

}  // namespace sqslam
