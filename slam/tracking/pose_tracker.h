#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "slam/features/matching.h"
#include "slam/geometry/camera.h"
#include "slam/map/tracking_view.h"
#include "slam/tracking/tracking_options.h"

namespace sqslam {

// A frame while its pose is found.
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

// Search for points around the places where the pose predicts them.
struct LocalSearch {
  double radius_factor = 1.0;         // widens the search
  int max_distance = kLooseDistance;  // bits
  bool anew = false;                  // matches made before are forgotten: only the pose is kept
  int min_inliers = 0;
};

// The part of the map that a frame may see (ORB-SLAM, Mur-Artal et al. 2015, V-D).
struct LocalMap {
  KeyframeId reference = kNoKeyframe;  // the keyframe that shares most points with the frame
  std::vector<PointId> points;         // points of the local keyframes, each once, alive
};

// `points`: what the frame is known to see (kNoPoint allowed). The search begins at the last reference
// keyframe and spreads over two steps of covisibility.
LocalMap FindLocalMap(const TrackingView& view, const std::vector<PointId>& points, KeyframeId last_reference,
                      int max_keyframes);

// The steps by which the pose of one frame is found against an immutable view of the map (after ORB-SLAM,
// Mur-Artal et al. 2015, V-B to V-D). No state between
// frames: tracking forward, tracking backward and relocalisation are made of the same steps. Each returns
// true where it succeeded; `frame` is then the better for it.
class PoseTracker {
 public:
  PoseTracker(const Camera& camera, const TrackingOptions& options);

  // Motion model: the points of a neighbouring frame, projected with T_frame_last as prediction.
  bool TrackMotion(const TrackingView& view, const TrackedFrame& last, const Rigid3d& T_frame_last,
                   TrackedFrame& frame) const;

  // Descriptors of the last frame's reference keyframe, for the times when the motion model fails: no
  // assumption on the motion.
  bool TrackReferenceKeyframe(const TrackingView& view, const TrackedFrame& last, TrackedFrame& frame) const;

  // Searches the points of all keyframes that see the same part of the scene, refines the pose with all of
  // them, and anchors the frame. frame.anchor.reference says where to begin.
  bool TrackLocalMap(const TrackingView& view, const LocalSearch& search, TrackedFrame& frame,
                     SeenPoints& seen) const;

  // No pose is known: descriptors of a keyframe, P3P in RANSAC, then searches of the local map that trust
  // descriptors only where they agree well. A wrong pose finds many map points by chance where descriptors
  // may differ more, and stays wrong.
  bool Relocate(const TrackingView& view, const ViewKeyframe& keyframe, TrackedFrame& frame) const;

  const ScaleLevels& Levels() const { return levels_; }

 private:
  bool LocateFrom(const TrackingView& view, const ViewKeyframe& keyframe, TrackedFrame& frame) const;
  bool Optimize(const TrackingView& view, int min_inliers, TrackedFrame& frame) const;

  Camera camera_;
  TrackingOptions options_;
  ScaleLevels levels_;
};

}  // namespace sqslam
