#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>

#include "slam/io/frame.h"
#include "slam/snapshot/snapshot.h"
#include "slam/system.h"
#include "slam/util/stage_times.h"

namespace sqslam::app {

// What a program that shows a run while it goes on wants of it. Any may be empty; they are called from the
// threads of the run and must be quick.
struct RunWatch {
  std::function<void(std::int64_t frames)> started;  // frames that will be played, 0: endless
  std::function<bool()>
      stopped;                  // never waits: whether go_on would say false, asked while a camera is learnt
  std::function<bool()> go_on;  // before each frame; may wait; false ends the run as Ctrl-C does
  std::function<void(const Frame&, TrackingState, const System&)>
      tracked;                                        // after each frame, tracking thread
  std::function<void(const MapSnapshotPtr&)> mapped;  // mapping thread

  // In place of DrawRun: a program with a window draws on the thread that has its OpenGL.
  std::function<void(const MapSnapshot& map, const std::filesystem::path& result, StageTimes& times)> draw;
};

}  // namespace sqslam::app
