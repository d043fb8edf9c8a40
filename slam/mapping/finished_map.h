#pragma once

#include <optional>

#include "slam/estimation/bundle_adjustment.h"
#include "slam/io/trajectory.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

// A map at the end of a run, with the poses of its frames.
struct FinishedMap {
  MapSnapshotPtr snapshot;
  Trajectory trajectory;  // every tracked frame
  Trajectory keyframes;
  // The camera as learnt from the map; empty where nothing was to be learnt (mapping.camera.what), or it was
  // learnt from another map of the same run.
  std::optional<LearntCamera> learnt_camera;
  int left_out = 0;  // objects that the chosen representation can't show, see ObjectMapper::Objects()
};

}  // namespace sqslam
