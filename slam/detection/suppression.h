#pragma once

#include <vector>

#include "slam/detection/scored_box.h"

namespace sqslam {

// Non-maximum suppression within each class: of two boxes that overlap by more than `iou`, the weaker goes.
// Strongest first; equal scores keep their order.
std::vector<ScoredBox> SuppressDoubles(std::vector<ScoredBox> boxes, double iou);

}  // namespace sqslam
