#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <vector>

#include "slam/geometry/superquadric.h"

namespace sqslam {

// The true objects and the errors of a map, for a picture that shows how good it is. Map frame.
struct MapTruth {
  std::vector<PosedSuperquadric> solids;  // of all true objects
  std::map<int, double> iou;              // of mapped objects with their true ones, by id; extra ones: 0
  std::map<std::int64_t, double> camera_error;  // of keyframes by id, where known; metres

  double MaxCameraError() const {
    double most = 0.0;
    for (const auto& [keyframe, error] : camera_error) {
      most = std::max(most, error);
    }
    return most;
  }
};

}  // namespace sqslam
