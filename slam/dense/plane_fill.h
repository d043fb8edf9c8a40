#pragma once

#include <vector>

#include "slam/dense/dense_options.h"
#include "slam/snapshot/depth_map.h"

namespace sqslam {

// Fills regions of one colour that lack depth, marked as kFilledByPlane: their known depths, inside and along
// the border, must lie on one plane or a few, and only pixels that they surround are filled. A region is a
// set of connected pixels with small colour steps. Earlier fills are dropped.
DepthMap FillPlanes(const DepthMap& map);

// Drops fills that fewer than `min_views` neighbours (filled likewise) confirm up to kMaxDepthDifference,
// behind which a neighbour measured a surface, since its ray would have passed through, or whose standard
// deviation is above `max_sigma`.
DepthMap KeepConfirmedFills(const DepthMap& map, const std::vector<DepthMap>& neighbours,
                            const DepthFusionOptions& options);

}  // namespace sqslam
