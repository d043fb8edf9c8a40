#pragma once

#include <limits>
#include <set>
#include <utility>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/map/map.h"
#include "slam/mapping/mapping_options.h"

// Local mapping around a new keyframe (ORB-SLAM, Mur-Artal et al. 2015, VI): culls rarely observed points,
// triangulates new ones, fuses duplicates, and culls redundant keyframes.
namespace sqslam {

// Pairs of keyframes connected by a loop closure; they stay edges of every later pose graph.
using LoopEdges = std::set<std::pair<KeyframeId, KeyframeId>>;

// Limits of the triangulation of new points.
struct NewPointOptions {
  int neighbours = 15;               // covisible keyframes to triangulate with
  double max_parallax_cos = 0.9998;  // cosine of the parallax angle above which no point is triangulated
};

// Search for duplicates of a keyframe's points.
struct FusionOptions {
  int second_neighbours = 5;  // covisible keyframes of each neighbour that are searched too
  double radius = 3.0;        // px at level 0, around a projected point
};

struct ProjectionSearch {
  double radius = 3.0;    // px at level 0, around the predicted position
  int max_distance = 50;  // bits
  // Squared error in units of the keypoint's variance; infinite: the radius alone decides.
  double max_squared_error = std::numeric_limits<double>::infinity();
};

// Returns the keypoint that matches a map point, or -1: near its projection, if scale and viewing direction
// allow a match. `T_camera_map` is the camera's pose in the point's map, in units of that map.
int FindKeypoint(const ScaleLevels& levels, const Camera& camera, const Rigid3d& T_camera_map,
                 const FrameFeatures& features, const MapPoint& point, const ProjectionSearch& search);

// The map points that a keyframe sees.
std::set<PointId> PointsOf(const Map& map, KeyframeId keyframe);

// Searches for the points in a keyframe of the same map. A match is fused with the point that its keypoint
// has (the one with fewer observations is removed), or becomes an observation. Returns the number of matches.
int FuseInto(Map& map, const Camera& camera, const std::set<PointId>& points, KeyframeId keyframe,
             const ProjectionSearch& search);

// Projects the keyframe's points into its neighbours and theirs into the keyframe (VI-C): fuses duplicates
// and adds missing observations. Returns the number of matches.
int FuseWithNeighbours(Map& map, const Camera& camera, KeyframeId keyframe,
                       const FusionOptions& options = {});

// Triangulates new map points from given matches (keypoint of the one, keypoint of the other keyframe)
// without a point on either side. Returns the new points.
std::vector<PointId> CreatePoints(Map& map, const Camera& camera, KeyframeId keyframe, KeyframeId neighbour,
                                  const std::vector<std::pair<int, int>>& matches,
                                  const NewPointOptions& options = {});

// Triangulates new map points between a keyframe and its most covisible neighbours from keypoints without a
// point, matched along the epipolar line (VI-C). Returns the new points.
std::vector<PointId> CreateNewPoints(Map& map, const Camera& camera, KeyframeId keyframe,
                                     const NewPointOptions& options = {});

// Creates new points, then fuses the keyframe's old and new points with its neighbours'. Returns the new
// points, some of which may already be fused into others.
std::vector<PointId> AddNewPoints(Map& map, const Camera& camera, KeyframeId keyframe);

// Removes young points that tracking rarely finds or that too few keyframes observe (VI-B). Erases from
// `young` the points that are removed or proven. Returns the number removed.
int CullPoints(Map& map, std::set<PointId>& young, KeyframeId newest);

// Removes redundant keyframes near `center` (VI-E), except the ends of loop edges, which later pose graphs
// need. Returns the removed ones.
std::vector<KeyframeId> CullKeyframes(Map& map, KeyframeId center, const CullingOptions& options,
                                      const LoopEdges& loop_edges);

}  // namespace sqslam
