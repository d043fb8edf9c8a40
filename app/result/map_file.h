#pragma once

#include <filesystem>

namespace sqslam::app {

// The recording that the user means: the file itself, or map.sqmap in a result folder.
inline std::filesystem::path MapFile(const std::filesystem::path& map) {
  return std::filesystem::is_directory(map) ? map / "map.sqmap" : map;
}

}  // namespace sqslam::app
