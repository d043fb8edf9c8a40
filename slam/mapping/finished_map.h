#pragma once

#include "slam/io/trajectory.h"
#include "slam/map/snapshot.h"

namespace sqslam {

// A map at the end of a run, with the poses of its frames.
struct FinishedMap {
  MapSnapshotPtr snapshot;
  Trajectory trajectory;  // every tracked frame
  Trajectory keyframes;
  int left_out = 0;  // objects that the chosen representation can't show, see ObjectMapper::Objects()
};

}  // namespace sqslam
