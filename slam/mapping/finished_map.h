#pragma once

#include <optional>

#include "slam/estimation/camera_learning.h"
#include "slam/io/trajectory.h"
#include "slam/snapshot/object_account.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

// A map at the end of a run, with the poses of its frames.
struct FinishedMap {
  MapSnapshotPtr snapshot;
  Trajectory trajectory;  // every tracked frame
  Trajectory keyframes;
  // Learnt from this map; empty if learning is off (mapping.camera.what) or used another map of the run.
  std::optional<LearntCamera> learnt_camera;
  ObjectAccount account;  // boxes of the whole run are counted in the first map
};

}  // namespace sqslam
