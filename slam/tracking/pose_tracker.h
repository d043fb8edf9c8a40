#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "slam/estimation/reprojection_error.h"
#include "slam/features/matching.h"
#include "slam/geometry/camera.h"
#include "slam/map/map.h"
#include "slam/tracking/tracking_options.h"

namespace sqslam {

// A frame whose pose is being estimated.
struct TrackedFrame {
  std::int64_t index = 0;
  double timestamp = 0.0;
  FrameFeaturesPtr features;
  std::vector<PointId> points;  // one per keypoint, kNoPoint if none
  Rigid3d T_camera_map;
  AnchoredPose anchor;
  int inliers = 0;  // map points that fit the pose

  void ClearPoints() { points.assign(features->Size(), kNoPoint); }
};

constexpr int kMinRecoveryInliers = 50;  // map points that confirm relocalisation or backward tracking

// Map points predicted to be visible in a frame, and those found in it.
struct SeenPoints {
  std::vector<PointId> visible;
  std::vector<PointId> found;
};

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

// Parameters of the search for map points around their predicted positions.
struct LocalSearch {
  double radius_factor = 1.0;             // widens the search
  int max_distance = kMaxGuidedDistance;  // bits
  bool discard_matches = false;           // discards earlier matches and keeps only the pose
  int min_inliers = 0;
};

// Estimates the pose of one frame against an immutable view of the map (after ORB-SLAM, Mur-Artal et al.
// 2015, V-B to V-D). Stateless between frames: forward tracking, backward tracking and relocalisation combine
// the same steps. Each returns true on success and writes its result to `frame`.
class PoseTracker {
 public:
  PoseTracker(const Camera& camera, const TrackingOptions& options);

  // Searches the last frame's points around their projections, predicted by the motion T_frame_last.
  bool TrackMotion(const TrackingView& view, const TrackedFrame& last, const Rigid3d& T_frame_last,
                   TrackedFrame& frame) const;

  // Matches descriptors of the last frame's reference keyframe, without assumptions on the motion: for when
  // the motion model fails.
  bool TrackReferenceKeyframe(const TrackingView& view, const TrackedFrame& last, TrackedFrame& frame) const;

  // Searches the points of all local keyframes, starting at frame.anchor.reference, refines the pose from all
  // matches, and anchors the frame.
  bool TrackLocalMap(const TrackingView& view, const LocalSearch& search, TrackedFrame& frame,
                     SeenPoints& seen) const;

  // Needs no prior pose: matches a keyframe's descriptors, runs P3P in RANSAC, then verifies strictly.
  bool Relocate(const TrackingView& view, const ViewKeyframe& keyframe, TrackedFrame& frame) const;

  // Like Relocate(), from the last frame, its reference keyframe and the newest ones: for consecutive images
  // too far apart for a prediction.
  bool TrackWithoutPrediction(const TrackingView& view, const TrackedFrame& last, TrackedFrame& frame,
                              SeenPoints& seen) const;

  // Like Relocate(), near a rough pose T_camera_map: searches the points of the keyframes around `reference`
  // within `radius` px of their predicted positions.
  bool LocateNear(const TrackingView& view, const Rigid3d& T_camera_map, KeyframeId reference, double radius,
                  TrackedFrame& frame) const;

  // Like Relocate(), from given matches of map points with keypoints of the frame: if views are far apart, a
  // single keyframe may share too few points with the frame. `reference`: a keyframe that shares many.
  bool LocateFrom(const TrackingView& view, const std::vector<std::pair<PointId, int>>& matches,
                  KeyframeId reference, int min_inliers, TrackedFrame& frame) const;

  // Returns true if chance may explain the matches of a tracked pose: few of the visible points were found.
  // Near a wrong prediction, a tenth of them find some keypoint that is alike enough for a search around it.
  static bool IsChance(const SeenPoints& seen);

  // Returns true if the frame's points determine its pose, not only in their part of the image: it leaves the
  // corners no more uncertain than `max_deviation` (CornerDeviation()).
  bool IsDetermined(const TrackingView& view, const TrackedFrame& frame,
                    double max_deviation = kMaxCornerDeviation) const;

  // Checks a suspicious step: if the image moved far since `last` and few of the visible points were found,
  // the search around a wrong prediction may have matched only distant points, which hardly move. Tries
  // without a prediction too and keeps the better pose.
  void RecheckWideStep(const TrackingView& view, const TrackedFrame& last, TrackedFrame& frame,
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

// A map point matched in a frame, kept to refine the frame's pose later.
struct FrameMatch {
  PointId point = kNoPoint;
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();  // undistorted
  float sigma = 1.0F;                               // standard deviation, px
  float detected_sigma = 1.0F;                      // before alignment, px
  int keypoint = 0;                                 // index in the frame's features
};

std::vector<FrameMatch> MatchesOf(const TrackedFrame& frame, const ScaleLevels& levels);

// Returns the pose T_camera_map of a frame, refined from its matches in the present map, which bundle
// adjustment has changed since the frame was tracked. Returns `T_camera_map` if fewer than `min_inliers`
// points fit.
Rigid3d RefineFrame(const Map& map, const Camera& camera, const std::vector<FrameMatch>& matches,
                    int min_inliers, const Rigid3d& T_camera_map);

// Frames that could not be tracked on arrival, and the next one that was: they are tracked backward from it
// once the map has grown.
struct Backlog {
  TrackedFrame next;                  // tracked
  std::vector<TrackedFrame> earlier;  // not tracked, oldest first
};

// Tracks the earlier frames from the newest to the oldest. Returns those whose pose was found.
std::vector<TrackedFrame> TrackBackward(const PoseTracker& tracker, const TrackingView& view,
                                        const Backlog& backlog, int min_inliers = kMinRecoveryInliers);

}  // namespace sqslam
