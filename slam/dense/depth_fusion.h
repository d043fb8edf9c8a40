#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "slam/dense/dense_cloud.h"
#include "slam/dense/dense_input.h"
#include "slam/dense/dense_options.h"
#include "slam/snapshot/depth_map.h"
#include "slam/snapshot/depth_recording.h"

namespace sqslam {

inline constexpr int kNeighbours = 8;                  // depth maps that each one is compared with
inline constexpr double kMaxDepthDifference = 0.0125;  // between agreeing depths, share of the depth

// Filters a depth map by its neighbours, as they were estimated. `views` counts those that see the pixel's
// point at the same depth up to kMaxDepthDifference; the depth becomes the mean of its own and theirs,
// weighted by their inverse variances. Pixels with fewer than min_views, more neighbours that see through
// them, or a standard deviation above max_sigma lose their depth.
DepthMap KeepConsistent(const DepthMap& map, const std::vector<DepthMap>& neighbours,
                        const DepthFusionOptions& options);

// Reports the progress of a step. Returns false to end it; finished depth maps stay.
using DensifyProgress = std::function<bool(int done, int total, const std::string& state)>;

struct FusedDepth {
  DenseCloud cloud;
  std::size_t measured = 0;  // pixels of all keyframes with a confirmed depth
  std::size_t filled = 0;    // pixels with a depth from a plane
};

// Filters each estimated depth map of the recording by its neighbours and writes the result back, fills plain
// regions by planes if enabled, and merges all into a cloud. `threads`: 0 for all hardware threads. Returns
// nothing if `progress` ended it.
std::optional<FusedDepth> FuseDepthMaps(const DenseInput& input, const std::vector<KeyframePlan>& plans,
                                        const DenseOptions& options, int threads, DepthRecording& recording,
                                        const DensifyProgress& progress);

}  // namespace sqslam
