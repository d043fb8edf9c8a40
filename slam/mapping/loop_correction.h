#pragma once

#include <map>
#include <set>
#include <utility>

#include "slam/geometry/camera.h"
#include "slam/map/map.h"
#include "slam/mapping/loop_options.h"
#include "slam/mapping/place_recognizer.h"

namespace sqslam {

// Pairs of keyframes that a closed loop ties; they stay edges of every later pose graph.
using LoopEdges = std::set<std::pair<KeyframeId, KeyframeId>>;

// Closes a loop within one map (ORB-SLAM, Mur-Artal et al. 2015, VII C-D): moves the current keyframe and its
// neighbours to where the known place says, fuses what both sides see, and spreads the error over the
// essential graph (spanning tree, strong covisibility, loop edges) by similarities. Adds an edge to `edges`.
void CorrectLoop(Map& map, const Camera& camera, const KnownPlace& place, const LoopOptions& options,
                 LoopEdges& edges);

// The similarity that brings the current keyframe's map into the frame of the known one's.
Sim3d SimilarityOfMaps(const Map& current_map, const Map& known_map, const KnownPlace& place);

// Makes one of the points that the keyframes around `place.current` and the known place both have; both must
// be in one map and one frame already. Renews the covisibility of all keyframes concerned.
void FusePlace(Map& map, const Camera& camera, const KnownPlace& place, const LoopOptions& options);

}  // namespace sqslam
