#pragma once

#include <cstdint>
#include <set>
#include <utility>
#include <vector>

#include "slam/features/matching.h"
#include "slam/geometry/camera.h"
#include "slam/map/map.h"
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

  // No pose is known: descriptors of a keyframe, P3P in RANSAC, then careful searches of the local map.
  bool Relocate(const TrackingView& view, const ViewKeyframe& keyframe, TrackedFrame& frame) const;

  // The same from the last frame, its reference keyframe and the newest ones: where images are far apart no
  // prediction leads to the next.
  bool TrackWithoutPrediction(const TrackingView& view, const TrackedFrame& last, TrackedFrame& frame,
                              SeenPoints& seen) const;

  // The same from several keyframes at once: of views that are far apart each shares too little with the
  // frame, all of them together may not.
  bool LocateAmong(const TrackingView& view, const std::set<KeyframeId>& keyframes, int min_inliers,
                   TrackedFrame& frame) const;

  // Looks for the pose without a prediction too, and keeps the better one, where the image has moved far
  // since `last` and the frame shows few of the points that it should: the search around a wrong prediction
  // may have found only what is far away and hardly moves.
  void DoubtWideStep(const TrackingView& view, const TrackedFrame& last, TrackedFrame& frame,
                     SeenPoints& seen) const;

  const ScaleLevels& Levels() const { return levels_; }

 private:
  bool LocateFrom(const TrackingView& view, const FrameFeatures& known,
                  const std::vector<PointId>& known_points, TrackedFrame& frame) const;
  bool LocateByMatches(const TrackingView& view, const std::vector<std::pair<PointId, int>>& matches,
                       int iterations, TrackedFrame& frame) const;
  bool ConfirmPose(const TrackingView& view, int min_inliers, TrackedFrame& frame, SeenPoints& seen) const;
  bool Optimize(const TrackingView& view, int min_inliers, TrackedFrame& frame) const;

  Camera camera_;
  TrackingOptions options_;
  ScaleLevels levels_;
};

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
