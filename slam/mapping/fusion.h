#pragma once

#include <limits>
#include <set>

#include "slam/geometry/camera.h"
#include "slam/map/map.h"
#include "slam/mapping/mapping_options.h"

namespace sqslam {

struct ProjectionSearch {
  double radius = 3.0;    // px at level 0, around the place where the point should be seen
  int max_distance = 50;  // bits
  // Squared error in units of the keypoint's variance; infinite: the radius alone decides.
  double max_squared_error = std::numeric_limits<double>::infinity();
};

// The keypoint that shows a map point, or -1: near its projection, at the scale and from the side from which
// it can be recognised. `T_camera_map`: pose of the camera in the point's map, in the units of that map.
int FindKeypoint(const ScaleLevels& levels, const Camera& camera, const Rigid3d& T_camera_map,
                 const FrameFeatures& features, const MapPoint& point, const ProjectionSearch& search);

// The map points that a keyframe sees.
std::set<PointId> PointsOf(const Map& map, KeyframeId keyframe);

// Looks for the points in a keyframe of the same map. A point that is found becomes one with the keypoint's
// point (the one with fewer observations goes), or is observed there. Returns the number of those found.
int FuseInto(Map& map, const Camera& camera, const std::set<PointId>& points, KeyframeId keyframe,
             const ProjectionSearch& search);

// Looks for the keyframe's points in its neighbours and the other way round, as ORB-SLAM's local mapping does
// (Mur-Artal et al. 2015, VI-C): points that are the same are fused, missing observations added. Returns the
// number of fusions.
int FuseWithNeighbours(Map& map, const Camera& camera, KeyframeId keyframe, const FusionOptions& options);

}  // namespace sqslam
