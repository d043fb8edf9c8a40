#pragma once

#include <vector>

#include "slam/objects/support.h"

namespace sqslam::testing {

// A horizontal surface at this height with map points up to 1 unit around the origin.
inline SupportSurfaces FlatSurface(double height) {
  std::vector<Eigen::Vector3d> points;
  for (int x = -20; x <= 20; ++x) {
    for (int y = -20; y <= 20; ++y) {
      points.emplace_back(0.05 * x, 0.05 * y, height);
    }
  }
  return SupportSurfaces::Find(points, GravityOptions());
}

}  // namespace sqslam::testing
