#pragma once

#include <vector>

#include "slam/dense/dense_options.h"
#include "slam/snapshot/depth_map.h"

namespace sqslam {

// The depth map with what its neighbours confirm: `views` counts those that see the pixel's point at the same
// depth up to max_difference, and the depth becomes the mean of its own and theirs. Pixels with fewer than
// min_views lose their depth. The neighbours are taken as they were estimated.
DepthMap KeepConsistent(const DepthMap& map, const std::vector<DepthMap>& neighbours,
                        const DepthFusionOptions& options);

}  // namespace sqslam
