#pragma once

#include <string>

#include "slam/geometry/box2.h"

namespace sqslam {

// One box of a detector in one image (distorted pixels, as the detector saw the image).
struct Detection {
  std::string label;   // blanks written as underscores, e.g. "cereal_box"
  double score = 1.0;  // in [0, 1]
  Box2d box;           // clipped to the image
};

}  // namespace sqslam
