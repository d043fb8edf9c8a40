#pragma once

#include <optional>
#include <string>
#include <vector>

#include "slam/dense/dense_input.h"

namespace sqslam {

// The views from which a keyframe's depth is estimated.
struct KeyframePlan {
  std::vector<Eigen::Vector3d> in_view;  // some of the map points that it sees
  std::optional<DepthRange> range;       // empty: no depth
  std::vector<std::size_t> views, fine;  // positions in DenseInput::frames
  std::string settings;                  // all that its depth follows from but the images, in short
};

// Those of the options that depth maps are estimated by, in short; the others say what becomes of them.
std::string EstimationSettings(const DenseOptions& options);

// The plan for a keyframe (a position in DenseInput::keyframes).
KeyframePlan PlanKeyframe(const DenseInput& input, std::size_t k, const DenseOptions& options);

// Plans for all keyframes of the input, in their order.
std::vector<KeyframePlan> PlanKeyframes(const DenseInput& input, const DenseOptions& options);

}  // namespace sqslam
