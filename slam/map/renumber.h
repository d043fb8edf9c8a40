#pragma once

#include <cstdint>

#include "slam/map/map.h"

namespace sqslam {

// Shifts that make the ids of one run unique beside those of another.
struct IdShift {
  KeyframeId keyframe = 0;
  PointId point = 0;
  int object = 0;
  std::int64_t submap = 0;
  std::int64_t frame = 0;
  double time = 0.0;  // s
};

// Shifts all ids of a map, and the indices and times of its frames.
void Renumber(const IdShift& shift, Map& map);

}  // namespace sqslam
