#pragma once

#include <limits>
#include <set>
#include <utility>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/map/map.h"
#include "slam/mapping/mapping_options.h"

// Local mapping around a new keyframe (ORB-SLAM, Mur-Artal et al. 2015, VI): points that hardly anybody sees
// go, new ones are triangulated, the same ones are fused, and keyframes that show nothing of their own go.
namespace sqslam {

// Pairs of keyframes that a closed loop ties; they stay edges of every later pose graph.
using LoopEdges = std::set<std::pair<KeyframeId, KeyframeId>>;

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

// Looks for the keyframe's points in its neighbours and the other way round (VI-C): points that are the same
// are fused, missing observations added. Returns the number of fusions.
int FuseWithNeighbours(Map& map, const Camera& camera, KeyframeId keyframe, const FusionOptions& options);

// Triangulates new map points between a keyframe and its most covisible neighbours: features without a map
// point, matched by descriptor along the epipolar line (VI-C). Returns the new points.
std::vector<PointId> CreateNewPoints(Map& map, const Camera& camera, KeyframeId keyframe,
                                     const NewPointOptions& options);

// Removes young points that tracking hardly finds or that too few keyframes see; `young` loses those that are
// gone or have passed. Returns the number removed (VI-B).
int CullPoints(Map& map, std::set<PointId>& young, KeyframeId newest, const CullingOptions& options);

// Removes keyframes near `center` whose points others see as well, but no end of a loop edge: later pose
// graphs need it. Returns the ones removed (VI-E).
std::vector<KeyframeId> CullKeyframes(Map& map, KeyframeId center, const CullingOptions& options,
                                      const LoopEdges& loop_edges);

}  // namespace sqslam
