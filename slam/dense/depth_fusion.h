#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "slam/dense/dense_cloud.h"
#include "slam/dense/keyframe_plan.h"
#include "slam/snapshot/depth_recording.h"

namespace sqslam {

// Reports the progress of a step. Returns false to end it; finished depth maps stay.
using DensifyProgress = std::function<bool(int done, int total, const std::string& state)>;

struct FusedDepth {
  DenseCloud cloud;
  std::size_t measured = 0;  // pixels of all keyframes with a confirmed depth
  std::size_t filled = 0;    // pixels with a depth by a plane
};

// Filters each estimated depth map of the recording by its neighbours and writes the result back, fills plain
// regions by planes if enabled, and merges all into a cloud. `threads`: 0 for all hardware threads. Returns
// nothing if `progress` ended it.
std::optional<FusedDepth> FuseDepthMaps(const DenseInput& input, const std::vector<KeyframePlan>& plans,
                                        const DenseOptions& options, int threads, DepthRecording& recording,
                                        const DensifyProgress& progress);

}  // namespace sqslam
