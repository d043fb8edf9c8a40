#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "slam/dense/keyframe_plan.h"
#include "slam/snapshot/depth_map.h"

namespace sqslam {

// Receives the depth map of a keyframe (a position in DenseInput::keyframes), empty if its images cannot be
// read. Returns false to stop.
using TakeDepthMap = std::function<bool(std::size_t keyframe, const std::optional<DepthMap>& map)>;

// Estimates the depth of the keyframes `jobs` by their plans, on up to `threads` threads (0: all hardware
// threads) within 400 MB. Calls `take` on the caller's thread, in the order in which maps become ready; the
// maps don't depend on the number of threads. Returns false if `take` stopped it; rethrows what `take` or a
// thread threw.
bool EstimateDepthMaps(const DenseInput& input, const std::vector<KeyframePlan>& plans,
                       const std::vector<std::size_t>& jobs, const StereoOptions& options, int threads,
                       const TakeDepthMap& take);

}  // namespace sqslam
