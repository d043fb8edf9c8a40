#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "slam/dense/dense_cloud.h"
#include "slam/dense/keyframe_plan.h"
#include "slam/snapshot/depth_recording.h"

namespace sqslam {

// Says how far a step is. False ends it; the depth maps that are done stay.
using DensifyProgress = std::function<bool(int done, int total, const std::string& state)>;

struct FusedDepth {
  DenseCloud cloud;
  std::size_t measured = 0;  // pixels of all keyframes with a depth that others confirm
  std::size_t filled = 0;    // and with one by a plane
};

// Holds each estimated depth map of the recording against those of its neighbours, puts what they confirm
// back into it, fills plain regions by planes where that is wanted, and gathers the cloud of all, on so many
// threads (0: as many as the machine runs at a time). Empty where `progress` ended it.
std::optional<FusedDepth> FuseDepthMaps(const DenseInput& input, const std::vector<KeyframePlan>& plans,
                                        const DenseOptions& options, int threads, DepthRecording& recording,
                                        const DensifyProgress& progress);

}  // namespace sqslam
