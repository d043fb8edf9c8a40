#pragma once

#include "slam/geometry/camera.h"
#include "slam/map/map.h"
#include "slam/mapping/mapping_options.h"

namespace sqslam {

// Looks for the keyframe's points in its neighbours and the other way round: points that are the same are
// fused, missing observations added. Returns the number of fusions.
int FuseWithNeighbours(Map& map, const Camera& camera, KeyframeId keyframe, const FusionOptions& options);

}  // namespace sqslam
