#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "slam/geometry/camera.h"
#include "slam/io/frame.h"
#include "slam/io/trajectory.h"
#include "slam/snapshot/kept_map.h"
#include "slam/system.h"
#include "slam/system_options.h"
#include "slam/util/run_counters.h"
#include "slam/util/stage_times.h"

namespace sqslam {

// Poses of frames in a kept map.
struct Localization {
  struct Pose {
    double timestamp = 0.0;  // seconds
    std::string image_path;
    Rigid3d T_map_camera;
  };
  int frames = 0;
  std::map<std::int64_t, Pose> poses;  // by index of the frame
  RunCounters counters;
  // Stages as in a run, and localization.first_pose: from the first frame to the first pose.
  std::map<std::string, StageTimes::Summary> timing_ms;
};

// Finds the poses of frames in a map that stays as it is: the pipeline of the tracking thread, with nobody at
// the other end. Parts of the map that stayed apart are left out, for poses in them would be in other frames.
class Localizer {
 public:
  // `options`: of the run that made the map. `name` of the map stands at the beginning of messages. Throws
  // InputError where the map is broken or was made with another vocabulary than the options name, UsageError
  // where they name none.
  Localizer(const KeptMap& map, const std::string& name, const SystemOptions& options);
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
