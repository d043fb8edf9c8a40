#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "slam/mapping/background_adjustment.h"
#include "slam/mapping/completion.h"
#include "slam/mapping/finished_map.h"
#include "slam/mapping/loop_correction.h"
#include "slam/mapping/place_recognizer.h"
#include "slam/mapping/submap.h"
#include "slam/objects/object_tracker.h"
#include "slam/util/run_counters.h"
#include "slam/util/stage_times.h"

namespace sqslam {

struct IdShift;

// The mapping thread's pipeline and the only owner of the live map. Takes the tracking thread's reports in
// order and publishes immutable copies: AtlasView for tracking, MapSnapshot for everyone else.
class Mapper {
 public:
  struct Outputs {
    std::function<void(AtlasViewPtr)> publish_atlas;
    std::function<void(MapSnapshotPtr)> publish_snapshot;
    std::function<bool()> keyframe_waiting;  // a waiting keyframe interrupts the bundle adjustment
    // Receives Save() of the growing map, so that it survives a killed run. Empty: never called.
    std::function<void(std::string)> keep = {};
    // Reads an image in the camera's size, 8UC3 or 8UC1, for the end of the run: to map views that are far
    // apart, and for the lines in boxes of frames placed then. Empty: neither.
    std::function<cv::Mat(const std::string& path, bool in_color)> read_image = {};
  };

  // A null `vocabulary` turns off loop closure and merging of submaps. `ids`: shared with the tracking
  // thread; null: its own.
  Mapper(const Camera& camera, const MapperOptions& options, std::shared_ptr<const Vocabulary> vocabulary,
         Outputs outputs, StageTimes& times, std::shared_ptr<IdSource> ids = nullptr);

  void Process(TrackingReport report);

  // Takes the objects of a frame whose report was processed before.
  void Process(SeenObjects objects);

  // Places leftovers until `stop` returns true, runs the last optimisation and publishes the last snapshot.
  // Returns the submaps, the one with the most frames first, without those that never grew. Call once.
  std::vector<FinishedMap> Finish(const std::function<bool()>& stop = {});

  // Serializes the live map, once Finish has been called, for Restore of a mapper with the same options. A
  // restored map serializes to the same bytes.
  std::string Save() const;

  struct Restored {
    std::int64_t submap = 0;        // number of the main submap, the one with the most frames
    std::int64_t oldest_frame = 0;  // of all restored submaps, after renumbering
    std::int64_t index_shift = 0;   // added to frame indices and times (s)
    double time_shift = 0.0;
  };

  // Restores a saved map to continue from, and publishes it. If the mapper has a map already, ids, frames and
  // times of the restored one are raised. `ids` will not issue ids that the map uses. Throws InputError, with
  // a message that begins with `what`, if the bytes are not a valid map.
  Restored Restore(std::string_view state, const std::string& what, const std::shared_ptr<IdSource>& ids);

  // Merges the submap with another one if they share a place. Returns true if it did.
  bool TieToOthers(std::int64_t submap);

  // Moves the live map of a submap out of the mapper, which must not be used afterwards.
  Map MapOf(std::int64_t submap) && { return std::move(submaps_.at(submap).Map()); }

  // Index and time (seconds) of the newest frame of all submaps; empty before the first.
  std::optional<std::pair<std::int64_t, double>> NewestFrame() const;

  const Camera& GetCamera() const { return camera_; }  // as learnt, once Finish has been called
  RunCounters Counters() const { return counters_; }   // resets, loops, returns and merges

 private:
  static constexpr int kFinalIterations = 10;    // of the bundle adjustment over a whole submap
  static constexpr int kMinSubmapKeyframes = 5;  // one with fewer is dropped, unless there is no other

  void MapKeyframe(const TrackingReport& report, bool begins);
  void CullKeyframesAround(KeyframeId keyframe);
  void MapObjects(bool moved_everywhere);
  void KeepGrownMap();
  void BeginSubmap(TrackingReport& report);
  void ActivateSubmapOf(const TrackingReport& report);
  void RecordFrame(TrackingReport& report);
  void RecordObjects(SeenObjects objects);
  void CountBoxes(const SeenObjects& objects);
  KeyframeId AddKeyframe(const TrackingReport& report);
  KeyframeId AddKeyframe(const TrackedFrame& frame, std::vector<FrameMatch> matches,
                         const Completion* completion = nullptr);
  void CountReturn(KeyframeId keyframe);
  void OptimizeAround(KeyframeId keyframe, const BundleAdjustmentOptions& options);
  void OptimizeWindow(const std::vector<KeyframeId>& window, const BundleAdjustmentOptions& options);
  void OptimizeGlobally(bool with_objects, bool with_frames = false);
  std::vector<const Map*> MapsActiveFirst() const;
  Submap& SubmapWith(KeyframeId keyframe);
  bool CloseLoop(KeyframeId keyframe);
  void MergeSubmaps(const LoopCandidate& loop, Submap& known);
  void AdjustInBackground(int iterations);
  bool ApplyAdjusted(std::optional<BackgroundAdjustment::Job> job);
  void KeepUpright(bool last);
  void MoveOrigins(std::int64_t submap, const Sim3d& S_new_old, std::int64_t new_submap);
  bool HasFrame(std::int64_t index) const;  // in any submap
  void TrackBacklog();
  void PublishView();
  MapSnapshotPtr MakeSnapshot();
  SnapshotProgress TakeProgress();
  void Complete(const std::function<bool()>& stop);
  ViewGraph MakeViewGraph() const;
  bool StartSubmap(Completion& completion);
  bool CloseLoopByViews(const Completion& completion, KeyframeId keyframe);
  std::size_t FramesInMain() const;
  bool HasMappedImages() const;
  std::vector<LeftoverFrame> ImagesWithSift(const std::function<bool()>& stop) const;
  bool MapAfresh(std::vector<LeftoverFrame> images, const std::function<bool()>& stop);
  void KeepImage(const TrackingReport& report);
  void TrackPlacedBoxes();
  void TrackBoxesOf(const LeftoverFrame& frame, Submap& submap, ObjectTracker& tracker);
  bool TieLeftoverSubmaps(const Completion& completion, CompletionAttempts& attempts);
  void DissolveSmallSubmaps();
  bool PlaceLeftovers(const Completion& completion, Submap& submap, CompletionAttempts& attempts);
  bool PlaceOnce(Submap& submap, const Completion& completion, CompletionAttempts::Kind kind,
                 CompletionAttempts& attempts);
  std::vector<Submap*> RankedSubmaps();
  void FinishSubmap(Submap& submap);
  void LearnFrom(Submap& submap);
  void Drop(std::int64_t submap);
  struct State;
  IdShift ShiftFor(const State& state, const IdSource& ids) const;

  Camera camera_;
  std::optional<LearntCamera> learnt_camera_;
  MapperOptions options_;
  std::shared_ptr<IdSource> ids_;
  Outputs outputs_;
  StageTimes& times_;
  PoseTracker pose_tracker_;

  std::map<std::int64_t, Submap> submaps_;  // by number
  Submap* active_ = nullptr;                // the submap that is being tracked
  AtlasView atlas_;                         // as last published
  std::optional<Backlog> backlog_;          // frames before the active submap began
  PlaceRecognizer places_;
  LoopEdges loop_edges_;
  KeyframeId last_loop_ = kNoKeyframe;  // keyframe at which the last loop was closed
  BackgroundAdjustment adjustment_;
  LeftoverFrames leftovers_;
  std::map<std::int64_t, LeftoverFrame> images_;  // all frames, until there are too many to map afresh
  bool keeps_images_ = true;
  std::map<std::int64_t, LeftoverFrame> placed_;  // at the end of the run
  RunCounters counters_;
  bool returned_ = false;  // the newest keyframe is covisible with an old one

  SeenObjects shown_;          // the newest frame with known bounding boxes, for the snapshot
  bool objects_seen_ = false;  // true once bounding boxes of any frame have arrived
  ObjectAccount seen_boxes_;   // of all frames, in the map or not
  int tracked_points_ = 0;
  // Tracking time of the frames since the last snapshot.
  double tracking_ms_ = 0.0;
  int tracking_count_ = 0;
  std::optional<std::chrono::steady_clock::time_point> step_start_;  // start of the current mapping step
  std::int64_t snapshots_ = 0;
  int keyframes_since_kept_ = 0;
  std::size_t kept_bytes_ = 0;  // of the map as last kept
};

}  // namespace sqslam
