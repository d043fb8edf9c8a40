#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "slam/geometry/rigid3.h"

namespace sqslam {

// A tracked frame as displays of a run show it.
struct FrameView {
  struct Feature {
    Eigen::Vector2f pixel;  // as the lens shows it
    bool tracked = false;   // a map point was found there
  };
  std::int64_t frame_index = 0;
  std::optional<Rigid3d> T_map_camera;  // in the map as tracking knew it; empty while it is lost
  std::vector<Feature> features;
};

}  // namespace sqslam
