#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "slam/io/frame.h"
#include "slam/map/map.h"
#include "slam/objects/object_tracker.h"
#include "slam/tracking/feature_stage.h"
#include "slam/tracking/initializer.h"
#include "slam/tracking/pose_tracker.h"
#include "slam/tracking/relocalizer.h"
#include "slam/tracking/rolling_shutter.h"
#include "slam/tracking/tracking_report.h"
#include "slam/util/run_counters.h"
#include "slam/util/stage_times.h"

namespace sqslam {

// The camera's motion from one tracked frame to the next.
struct FrameMotion {
  Rigid3d T_current_last;
  std::int64_t frames = 1;  // from the one to the other: more than 1 if frames were left out

  // Returns the motion over another number of frames, at constant velocity.
  Rigid3d Across(std::int64_t other_frames) const {
    if (other_frames == frames) {
      return T_current_last;
    }
    const double share = static_cast<double>(other_frames) / static_cast<double>(frames);
    return {Eigen::Quaterniond::Identity().slerp(share, T_current_last.rotation),
            share * T_current_last.translation};
  }
};

// The tracking thread's pipeline: estimates the pose of each frame against an immutable view of the map, and
// tracks objects. Holds no reference to the live map. The order of attempts (constant velocity, then the
// reference keyframe, then the local map; relocalisation by bag of words once lost) and the rules for new
// keyframes follow ORB-SLAM (Mur-Artal et al. 2015, V).
class Tracker {
 public:
  // `ids`: shared with the mapping thread. Without a `vocabulary`, relocalises in the last keyframe only.
  Tracker(const Camera& camera, const TrackingOptions& options, const ObjectOptions& objects,
          std::shared_ptr<IdSource> ids, std::shared_ptr<const Vocabulary> vocabulary, StageTimes& times);

  // Begins lost in one of several existing maps. Call before the first frame.
  void BeginIn(const AtlasViewPtr& atlas, std::int64_t submap);

  // Begins to extract the features of a frame that Track() gets later. Call in the order of frames.
  void Expect(const Frame& frame) { features_.Expect(frame); }

  // Tracks one frame. `atlas`: the newest from the mapping thread (null before the first).
  // `pending_keyframes`: posted keyframes that the mapping thread has not processed yet.
  TrackingReport Track(const Frame& frame, const AtlasViewPtr& atlas, int pending_keyframes);

  // Takes the boxes of a frame tracked with detections_follow; call in the order of frames. Returns nothing
  // if that frame is no longer waiting.
  std::optional<SeenObjects> AddDetections(std::int64_t frame_index,
                                           const std::vector<Detection>& detections);

  double Readout() const { return shutter_.Readout(); }  // seconds, as learnt; 0: all rows at once
  FrameView Newest() const;                              // the frame tracked last

  bool Initialized() const { return view_ != nullptr; }
  bool Lost() const { return lost_frames_ > 0; }
  RunCounters Counters() const { return counters_; }  // losses and relocalizations
  std::string NoMapReason() const { return initializer_.Reason(); }

 private:
  // A frame whose boxes have not come yet.
  struct WaitingFrame {
    SeenObjects seen;
    std::optional<ObjectFrame> objects;  // empty if the frame was not tracked
  };

  FrameStamp StampOf(const Frame& frame) const;
  void BeginFrame(const Frame& frame, const FrameFeaturesPtr& features);
  FrameFeaturesPtr FeaturesToKeep(const Frame& frame, const cv::Mat& ignored, bool tracked);
  void AdoptAtlas(const AtlasViewPtr& atlas);
  void MoveLastFrame();
  bool EstimatePose(TrackingReport& report);
  Rigid3d PredictedMotion() const;
  std::optional<CameraMotion> Motion() const;
  std::vector<ShutterObservation> ShutterObservations() const;
  bool Relocalize(const Frame& image, TrackingReport& report);
  void BeginSubmapOrWait(TrackingReport& report);
  void ReportPose(int pending_keyframes, TrackingReport& report);
  void ShareBacklog(TrackingReport& report);
  double TrackedShare() const;
  bool NeedsKeyframe(int pending_keyframes) const;
  void TrackObjects(const Frame& frame, bool tracked, TrackingReport& report);
  ObjectFrame MakeObjectFrame(const Frame& frame) const;
  bool MoveToPresentMap(WaitingFrame& waiting) const;
  void SwitchSubmap(std::int64_t submap, const TrackingViewPtr& view, const Sim3d& S_map_origin);
  ObjectTracker& Objects() { return object_trackers_.at(submap_); }

  Camera camera_;
  TrackingOptions options_;
  FeatureStage features_;
  OrbExtractor rich_extractor_;  // for frames that share little with those before
  int rich_frames_ = 0;
  PoseTracker pose_tracker_;
  RollingShutter shutter_;
  Initializer initializer_;
  Relocalizer relocalizer_;
  ObjectOptions object_options_;
  StageTimes& times_;

  AtlasViewPtr atlas_;
  std::int64_t submap_ = -1;  // the submap being tracked; -1: none has begun
  std::int64_t submaps_begun_ = 0;
  TrackingViewPtr view_;                                   // view of submap_
  Sim3d S_map_origin_;                                     // origin of view_
  std::map<std::int64_t, ObjectTracker> object_trackers_;  // by submap

  TrackedFrame current_;
  std::optional<TrackedFrame> last_;
  std::optional<FrameMotion> velocity_;  // between the last two frames that were tracked
  std::optional<CameraMotion> motion_;   // at the current frame, if it was tracked from the last one
  std::vector<TrackedFrame> untracked_;  // since the last tracked frame
  std::deque<WaitingFrame> waiting_;     // the oldest first
  std::int64_t last_keyframe_index_ = 0;
  double last_keyframe_time_ = 0.0;  // s
  int lost_frames_ = 0;              // since tracking was lost; 0: not lost
  RunCounters counters_;
};

}  // namespace sqslam
