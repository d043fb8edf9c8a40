#pragma once

#include <vector>

#include "slam/geometry/camera.h"
#include "slam/map/map.h"
#include "slam/mapping/mapping_options.h"

namespace sqslam {

// Triangulates new map points between a keyframe and its most covisible neighbours: features without a map
// point, matched by descriptor along the epipolar line (ORB-SLAM, Mur-Artal et al. 2015, VI-C). Returns the
// new points.
std::vector<PointId> CreateNewPoints(Map& map, const Camera& camera, KeyframeId keyframe,
                                     const NewPointOptions& options);

}  // namespace sqslam
