#pragma once

#include <vector>

#include "slam/map/map.h"

namespace sqslam {

// The part of the map that a frame may see (ORB-SLAM, Mur-Artal et al. 2015, V-D).
struct LocalMap {
  KeyframeId reference = kNoKeyframe;  // the keyframe that shares most points with the frame
  std::vector<PointId> points;         // points of the local keyframes, each once, alive
};

// `points`: map points matched in the frame (kNoPoint allowed). Starts at the last reference keyframe and
// covers two steps of covisibility.
LocalMap FindLocalMap(const TrackingView& view, const std::vector<PointId>& points, KeyframeId last_reference,
                      int max_keyframes);

// Returns the keyframe, or the newest one if it no longer exists.
const ViewKeyframe& ExistingKeyframe(const TrackingView& view, KeyframeId id);

}  // namespace sqslam
