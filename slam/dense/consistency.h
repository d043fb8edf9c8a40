#pragma once

#include <vector>

#include "slam/dense/dense_options.h"
#include "slam/snapshot/depth_map.h"

namespace sqslam {

// Filters a depth map by its neighbours, as they were estimated. `views` counts those that see the pixel's
// point at the same depth up to max_difference; the depth becomes the mean of its own and theirs. Pixels with
// fewer than min_views, or more neighbours that see through them, lose their depth.
DepthMap KeepConsistent(const DepthMap& map, const std::vector<DepthMap>& neighbours,
                        const DepthFusionOptions& options);

}  // namespace sqslam
