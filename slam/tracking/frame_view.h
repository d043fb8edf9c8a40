#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "slam/geometry/rigid3.h"

namespace sqslam {

// A tracked frame, for display.
struct FrameView {
  struct Feature {
    Eigen::Vector2f pixel;  // in the image as taken, distorted
    bool tracked = false;   // a map point was found there
  };
  std::int64_t frame_index = 0;
  std::optional<Rigid3d> T_map_camera;  // in tracking's view of the map; empty while lost
  std::vector<Feature> features;
};

}  // namespace sqslam
