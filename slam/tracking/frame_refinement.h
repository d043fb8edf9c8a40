#pragma once

#include <cstdint>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/map/map.h"
#include "slam/map/tracking_view.h"
#include "slam/tracking/pose_tracker.h"

namespace sqslam {

// A map point as a frame shows it: what is kept of a frame to find its pose again.
struct FrameMatch {
  PointId point = kNoPoint;
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();  // undistorted
  float variance = 1.0F;                            // px^2
};

std::vector<FrameMatch> MatchesOf(const TrackedFrame& frame, const ScaleLevels& levels);

// Pose T_camera_map of a frame in the map as it is now, from the points that it was tracked by; the frame was
// tracked in a younger map, which bundle adjustment has bent straight since. Returns `T_camera_map` where
// fewer than `min_inliers` points are left that fit.
Rigid3d RefineFrame(const Map& map, const Camera& camera, const std::vector<FrameMatch>& matches,
                    int min_inliers, const Rigid3d& T_camera_map);

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
