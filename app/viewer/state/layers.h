#pragma once

#include <filesystem>
#include <string>

#include "render/scene/scene_layers.h"

namespace sqslam::viewer {

// What is drawn with the map and is no part of it; a part of ViewerState. Panels set what is wanted, the
// viewer reads it and fills in the rest (LayerSession).
struct Layers {
  bool true_path = false;          // wanted
  std::filesystem::path sequence;  // whose; empty: the one that was mapped
  bool dense_cloud = false;        // wanted
  std::filesystem::path cloud_file;
  bool cloud_in_world = false;  // the file is in the frame of the true poses, otherwise in the map's

  SceneLayers drawn;        // map frame
  int version = 0;          // counted up when that changes
  double path_error = 0.0;  // RMSE between keyframes and the true path, metres
  int path_pairs = 0;       // keyframes that were compared; 0: there is none
  bool reading = false;
};

// Whether a file is one of those that can be a dense cloud, by its name.
inline bool IsCloudFile(const std::filesystem::path& file) {
  return file.extension() == ".ply" || file.extension() == ".PLY";
}

}  // namespace sqslam::viewer
