#pragma once

#include "slam/geometry/box2.h"

namespace sqslam {

// A box as a network gives it, in pixels of its input.
struct ScoredBox {
  Box2d box;
  int class_number = 0;
  double score = 0.0;  // in [0, 1]
};

}  // namespace sqslam
