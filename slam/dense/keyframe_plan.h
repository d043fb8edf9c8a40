#pragma once

#include <optional>
#include <string>
#include <vector>

#include "slam/dense/dense_input.h"

namespace sqslam {

// The views from which a keyframe's depth is estimated.
struct KeyframePlan {
  std::vector<Eigen::Vector3d> in_view;  // a sample of the map points that it sees
  std::optional<DepthRange> range;       // empty: no depth
  std::vector<std::size_t> views, fine;  // positions in DenseInput::frames
  std::string settings;                  // fingerprint of all that its depth depends on but the images
};

// Returns a fingerprint of the options for depth estimation, without those for later steps.
std::string EstimationSettings(const DenseOptions& options);

// Plans a keyframe (a position in DenseInput::keyframes).
KeyframePlan PlanKeyframe(const DenseInput& input, std::size_t k, const DenseOptions& options);

// Plans all keyframes of the input, in their order.
std::vector<KeyframePlan> PlanKeyframes(const DenseInput& input, const DenseOptions& options);

}  // namespace sqslam
