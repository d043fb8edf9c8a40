#pragma once

#include <cstdint>
#include <vector>

#include "slam/map/tracking_view.h"
#include "slam/tracking/pose_tracker.h"

namespace sqslam {

// Frames that could not be tracked when they came, and the first one that could after them: from there they
// are tracked backward, once the map has grown.
struct Backlog {
  TrackedFrame next;                  // tracked
  std::vector<TrackedFrame> earlier;  // not tracked, the oldest first
};

// Tracks the earlier frames from the newest to the oldest. Returns those whose pose was found.
std::vector<TrackedFrame> TrackBackward(const PoseTracker& tracker, const TrackingView& view,
                                        const Backlog& backlog, int min_inliers);

}  // namespace sqslam
