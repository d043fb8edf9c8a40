#pragma once

#include <cstdint>

#include "slam/map/map.h"

namespace sqslam {

// The amounts by which the ids of one run are raised to stand beside those of another.
struct IdShift {
  KeyframeId keyframe = 0;
  PointId point = 0;
  int object = 0;
  std::int64_t submap = 0;
  std::int64_t frame = 0;
  double time = 0.0;  // s
};

// Raises all ids of a map, the indices of its frames and their times.
void Renumber(const IdShift& shift, Map& map);

}  // namespace sqslam
