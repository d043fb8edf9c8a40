#pragma once

#include <vector>

#include "slam/map/tracking_view.h"

namespace sqslam {

// The part of the map that a frame may see (ORB-SLAM, Mur-Artal et al. 2015, V-D).
struct LocalMap {
  KeyframeId reference = kNoKeyframe;  // the keyframe that shares most points with the frame
  std::vector<PointId> points;         // points of the local keyframes, each once, alive
};

// `points`: what the frame is known to see (kNoPoint allowed). The search begins at the last reference
// keyframe and spreads over two steps of covisibility.
LocalMap FindLocalMap(const TrackingView& view, const std::vector<PointId>& points, KeyframeId last_reference,
                      int max_keyframes);

}  // namespace sqslam
