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
#include "slam/snapshot/saved_map.h"
#include "slam/snapshot/snapshot.h"
#include "slam/system_options.h"
#include "slam/tracking/tracking_report.h"
#include "slam/util/run_counters.h"
#include "slam/util/stage_times.h"

namespace sqslam {

enum class TrackingState { kNotInitialized, kTracking, kLost };

// Result of a run, after the last optimisation.
struct RunResult {
  int frames = 0;
  int tracked = 0;
  double readout = 0.0;  // learnt time between the first and the last row of an image, seconds; 0: none
  RunCounters counters;
  FinishedMap map;  // the map with the most frames; its snapshot is null if no map could be built
  std::vector<FinishedMap> others;  // submaps that could not be merged with it, each in its own frame
  std::string no_map_reason;        // one line, if there is no map: static camera, no texture, ...
  std::map<std::string, StageTimes::Summary> timing_ms;
  SavedMap kept;  // the map and the others, to continue from; its state is empty if there is no map
  std::optional<AddedFrames> added;  // if a saved map was extended
};

// The public interface of the SLAM core.
//
//   System system(camera, options, [&](MapSnapshotPtr snapshot) { recorder.Add(*snapshot); });
//   while (auto frame = source.Next()) {
//     system.Process(*frame);
//   }
//   RunResult result = system.Finish();
//
// Process() tracks on the caller's thread; mapping runs on its own thread, in step with tracking if
// options.in_step is set, or alternates with it if options.deterministic is set. The mapping thread calls
// on_snapshot, one call at a time, and on_kept whenever the live map has grown by a quarter.
class System {
 public:
  using SnapshotCallback = std::function<void(MapSnapshotPtr)>;
  using KeptCallback = std::function<void(SavedMap)>;

  System(const Camera& camera, const SystemOptions& options, SnapshotCallback on_snapshot,
         KeptCallback on_kept = {});

  // Extends a saved map, starting lost in it: until relocalised there, the camera builds a separate submap.
  // Frames and times continue after those of the map, unless they are later anyway. `name`: of the map, at
  // the beginning of messages. Throws InputError as Localizer does.
  System(const SavedMap& map, const std::string& name, const SystemOptions& options,
         SnapshotCallback on_snapshot, KeptCallback on_kept = {});
  ~System();
  System(const System&) = delete;
  System& operator=(const System&) = delete;

  // Begins to extract the features of a frame while others are tracked and mapped; Process() gets it later,
  // in the same order. Not for frames with detections_follow. Call from the thread that calls Process().
  void Expect(const Frame& frame);

  TrackingState Process(const Frame& frame);

  // Takes the boxes of a frame that was processed with detections_follow; call from the thread that calls
  // Process(), in the order of frames. Frames may be left out.
  void AddDetections(std::int64_t frame_index, const std::vector<Detection>& detections);

  FrameView Newest() const;  // the frame processed last; call from the thread that calls Process()

  // Ends mapping and publishes the final snapshot; call once. Before that, retries frames and submaps without
  // a place in the map, until `stop`, called between them, returns true (empty: retries all).
  RunResult Finish(const std::function<bool()>& stop = {});

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sqslam
