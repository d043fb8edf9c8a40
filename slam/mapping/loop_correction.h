#pragma once

#include "slam/geometry/camera.h"
#include "slam/map/map.h"
#include "slam/mapping/local_mapping.h"
#include "slam/mapping/place_recognizer.h"

namespace sqslam {

// Closes a loop within one map (ORB-SLAM, Mur-Artal et al. 2015, VII C-D): moves the current keyframe and its
// neighbours to their poses as seen from the known keyframe, fuses the points that both sides see, and
// spreads the error over the essential graph (spanning tree, strong covisibility, loop edges) by
// similarities. Adds an edge to `edges`.
void CorrectLoop(Map& map, const Camera& camera, const LoopCandidate& loop, LoopEdges& edges);

// Returns the similarity from the frame of the current keyframe's map to the frame of the known one's.
Sim3d SimilarityOfMaps(const Map& current_map, const Map& known_map, const LoopCandidate& loop);

// Fuses the points that the keyframes around `loop.current` share with the known side. Both sides must be in
// one map and one frame. Updates the covisibility of the keyframes around `loop.current`.
void FuseLoop(Map& map, const Camera& camera, const LoopCandidate& loop);

}  // namespace sqslam
