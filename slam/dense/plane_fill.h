#pragma once

#include <vector>

#include "slam/dense/dense_options.h"
#include "slam/snapshot/depth_map.h"

namespace sqslam {

// The depth map with depths, marked as kFilledByPlane, where a region of one colour has none: the region's
// depths that are known, within it and along its border, must lie on one plane, and only what they surround
// is filled. Regions are connected pixels between which the colour changes by little. Earlier fills are
// dropped.
DepthMap FillPlanes(const DepthMap& map, const FillOptions& options);

// Drops what was filled where fewer than `min_views` of the neighbours (filled likewise) have the same depth
// up to `max_difference` of it, or where one measured a surface behind it: its ray would have passed through.
DepthMap KeepConfirmedFills(const DepthMap& map, const std::vector<DepthMap>& neighbours,
                            const DepthFusionOptions& options);

}  // namespace sqslam
