#pragma once

#include <map>
#include <memory>
#include <string>

#include "slam/geometry/camera.h"
#include "slam/io/frame.h"
#include "slam/io/trajectory.h"
#include "slam/snapshot/saved_map.h"
#include "slam/system.h"
#include "slam/system_options.h"
#include "slam/util/run_counters.h"
#include "slam/util/stage_times.h"

namespace sqslam {

// Poses of frames in a saved map.
struct Localization {
  struct Pose : TimedPose {
    std::string image_path;
  };
  int frames = 0;
  std::map<std::int64_t, Pose> poses;  // by index of the frame
  RunCounters counters;
  // Stages as in a run, and localization.first_pose: time from the first frame to the first pose.
  std::map<std::string, StageTimes::Summary> timing_ms;
};

// Finds the poses of frames in a map that stays unchanged: the tracking thread's pipeline without mapping.
// Uses the main map only, as poses in unconnected submaps would be in other frames.
class Localizer {
 public:
  // `options`: of the run that made the map. `name`: of the map, at the beginning of messages. Throws
  // InputError if the map is broken or was made with another vocabulary than that of the options, UsageError
  // if these name none.
  Localizer(const SavedMap& map, const std::string& name, const SystemOptions& options);
  ~Localizer();
  Localizer(const Localizer&) = delete;
  Localizer& operator=(const Localizer&) = delete;

  TrackingState Process(const Frame& frame);
  Localization Finish();  // call once

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sqslam
