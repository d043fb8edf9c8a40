#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "slam/dense/keyframe_plan.h"
#include "slam/snapshot/depth_map.h"

namespace sqslam {

// Takes the depth map of a keyframe (a position in DenseInput::keyframes), empty where its images cannot be
// read. False ends the work.
using TakeDepthMap = std::function<bool(std::size_t keyframe, const std::optional<DepthMap>& map)>;

// Estimates the depth of the keyframes `jobs` by their plans on several threads, each one keyframe at a time.
// `take` is called on the caller's thread, in the order in which the maps become ready; each map is the same
// with any number of threads (0: as many as the machine runs at a time, within 400 MB). Returns false where
// `take` ended it; throws what it or a thread threw.
bool EstimateDepthMaps(const DenseInput& input, const std::vector<KeyframePlan>& plans,
                       const std::vector<std::size_t>& jobs, const StereoOptions& options, int threads,
                       const TakeDepthMap& take);

}  // namespace sqslam
