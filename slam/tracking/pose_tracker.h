#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/map/tracking_view.h"
#include "slam/tracking/tracking_options.h"

namespace sqslam {

// A frame and what is known of it while its pose is found.
struct TrackedFrame {
  std::int64_t index = 0;
  double timestamp = 0.0;
  FrameFeaturesPtr features;
  std::vector<PointId> points;  // one per keypoint, kNoPoint where none
  Rigid3d T_camera_map;
  AnchoredPose anchor;
  int inliers = 0;  // map points that fit the pose

  void ForgetPoints() { points.assign(features->Size(), kNoPoint); }
};

// Map points that a frame should show, and the ones of them that it does show.
struct SeenPoints {
  std::vector<PointId> visible;
  std::vector<PointId> found;
};

// The steps by which the pose of one frame is found against an immutable view of the map. No state between
// frames: tracking forward, tracking backward and relocalisation are made of the same steps. Each returns
// whether it succeeded; `frame` is then the better for it.
class PoseTracker {
 public:
  PoseTracker(const Camera& camera, const TrackingOptions& options);

  // Motion model: the points of a neighbouring frame, projected with T_frame_last as prediction.
  bool TrackMotion(const TrackingView& view, const TrackedFrame& last, const Rigid3d& T_frame_last,
                   TrackedFrame& frame) const;

  // Where the motion model fails: descriptors of the last frame's reference keyframe, with no assumption on
  // the motion.
  bool TrackReferenceKeyframe(const TrackingView& view, const TrackedFrame& last, TrackedFrame& frame) const;

  // Searches the points of all keyframes that see the same part of the scene, refines the pose with all of
  // them, and anchors the frame. `radius_factor` widens the search. frame.anchor.reference says where to
  // begin.
  bool TrackLocalMap(const TrackingView& view, double radius_factor, int min_inliers, TrackedFrame& frame,
                     SeenPoints& seen) const;

  // No pose is known: descriptors of a keyframe, P3P in RANSAC, refinement.
  bool LocateFrom(const TrackingView& view, const ViewKeyframe& keyframe, TrackedFrame& frame) const;

  const ScaleLevels& Levels() const { return levels_; }

 private:
  bool Optimize(const TrackingView& view, int min_inliers, TrackedFrame& frame) const;

  Camera camera_;
  TrackingOptions options_;
  ScaleLevels levels_;
};

}  // namespace sqslam
