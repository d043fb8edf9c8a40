#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "slam/estimation/pose_optimization.h"
#include "slam/io/frame.h"
#include "slam/map/tracking_view.h"
#include "slam/objects/object_tracker.h"
#include "slam/tracking/initializer.h"
#include "slam/tracking/local_map.h"
#include "slam/tracking/tracking_report.h"
#include "slam/util/stage_times.h"

namespace sqslam {

// The tracking thread's pipeline: pose of each frame against an immutable view of the map, and the objects'
// share of the front end. Holds no reference to the live map.
class Tracker {
 public:
  Tracker(const Camera& camera, const TrackingOptions& options, const ObjectOptions& objects,
          std::uint64_t seed, StageTimes& times);

  // Tracks one frame. `view`: the newest that the mapping thread has published (null before the first).
  // `pending_keyframes`: keyframes posted that the mapping thread has not taken in yet.
  TrackingReport Track(const Frame& frame, const TrackingViewPtr& view, int pending_keyframes);

  bool Initialized() const { return view_ != nullptr; }
  bool Lost() const { return lost_frames_ > 0; }
  int Losses() const { return losses_; }
  int Recoveries() const { return recoveries_; }
  int Resets() const { return resets_; }
  std::string NoMapReason() const { return initializer_.Reason(); }

 private:
  enum class KeyframeDecision { kNo, kPostponed, kYes };

  struct TrackedFrame {
    std::int64_t index = 0;
    double timestamp = 0.0;
    FrameFeaturesPtr features;
    std::vector<PointId> points;  // one per keypoint
    Rigid3d T_camera_map;
    AnchoredPose anchor;
  };

  void Initialize(TrackingReport& report);
  void AdoptView(const TrackingViewPtr& view);
  bool EstimatePose(TrackingReport& report);
  bool TrackMotion();
  bool TrackReferenceKeyframe();
  bool TrackLocalMap(double radius_factor, int min_inliers, TrackingReport& report);
  bool Recover(TrackingReport& report);
  bool RecoverFrom(const ViewKeyframe& keyframe);
  int OptimizeCurrentPose();
  void AfterLoss(TrackingReport& report);
  KeyframeDecision DecideKeyframe(int pending_keyframes) const;
  void TrackObjects(const Frame& frame, TrackingReport& report);

  Camera camera_;
  TrackingOptions options_;
  ScaleLevels levels_;
  OrbExtractor extractor_;
  Initializer initializer_;
  ObjectOptions object_options_;
  std::uint64_t seed_;
  ObjectTracker object_tracker_;
  StageTimes& times_;

  TrackingViewPtr view_;
  std::int64_t map_number_ = 0;
  TrackedFrame current_;
  std::optional<TrackedFrame> last_;
  std::optional<Rigid3d> velocity_;  // T_current_last of the last two frames
  int current_inliers_ = 0;
  std::int64_t last_keyframe_index_ = 0;
  int lost_frames_ = 0;  // since tracking was lost; 0: not lost
  int losses_ = 0;
  int recoveries_ = 0;
  int resets_ = 0;
};

}  // namespace sqslam
