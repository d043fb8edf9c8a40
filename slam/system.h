#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "slam/geometry/box2.h"
#include "slam/geometry/camera.h"
#include "slam/io/frame.h"
#include "slam/io/trajectory.h"
#include "slam/mapping/finished_map.h"
#include "slam/snapshot/kept_map.h"
#include "slam/snapshot/snapshot.h"
#include "slam/system_options.h"
#include "slam/tracking/frame_view.h"
#include "slam/util/run_counters.h"
#include "slam/util/stage_times.h"

namespace sqslam {

enum class TrackingState { kNotInitialized, kTracking, kLost };

// Outcome of a run, after the last optimisation.
struct RunResult {
  int frames = 0;
  int tracked = 0;
  double readout = 0.0;  // seconds between the first and the last row of an image, as learnt; 0: none
  RunCounters counters;
  FinishedMap map;  // the one with the most frames; its snapshot is null where no map could be built
  std::vector<FinishedMap> others;  // submaps that could not be merged with it, each in a frame of its own
  std::string no_map_reason;        // one line, where map is null: static camera, no texture, ...
  std::map<std::string, StageTimes::Summary> timing_ms;
  KeptMap kept;  // the map and the others, to go on with; its state is empty where there is none
  std::optional<AddedFrames> added;  // where a kept map was gone on with
};

// The only door to the SLAM core.
//
//   System system(camera, options, [&](MapSnapshotPtr snapshot) { recorder.Add(*snapshot); });
//   while (auto frame = source.Next()) system.Process(*frame);
//   RunResult result = system.Finish();
//
// Process() tracks on the caller's thread; mapping runs on a thread of its own, or in turn with tracking
// where options.deterministic is set. on_snapshot is called from the mapping thread, one call at a time, and
// so is on_kept, each time that the live map has grown by a quarter.
class System {
 public:
  using SnapshotCallback = std::function<void(MapSnapshotPtr)>;
  using KeptCallback = std::function<void(KeptMap)>;

  System(const Camera& camera, const SystemOptions& options, SnapshotCallback on_snapshot,
         KeptCallback on_kept = {});

  // Goes on mapping in a kept map, as a camera that is lost in it: until it is found there, a map of its own
  // grows beside. Frames and times are numbered on from where the map ends, unless they are later anyway.
  // `name` of the map stands at the beginning of messages. Throws InputError as Localizer does.
  System(const KeptMap& map, const std::string& name, const SystemOptions& options,
         SnapshotCallback on_snapshot, KeptCallback on_kept = {});
  ~System();
  System(const System&) = delete;
  System& operator=(const System&) = delete;

  TrackingState Process(const Frame& frame);

  // Takes the boxes of a frame that was processed with detections_follow, from the thread that calls
  // Process(), frames in order. Those of a frame that was left out are not waited for.
  void AddDetections(std::int64_t frame_index, const std::vector<Detection>& detections);

  FrameView Newest() const;  // the frame processed last; for the thread that calls Process()
  RunResult Finish();        // ends mapping, publishes the final snapshot; call once

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sqslam
