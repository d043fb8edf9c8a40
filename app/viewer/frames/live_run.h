#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "app/run/terminal_run.h"
#include "app/viewer/frames/timeline.h"
#include "app/viewer/model/run_history.h"
#include "slam/run/run_pipeline.h"

namespace sqslam::viewer {

// A run of the pipeline on threads of its own, of which a window takes the newest state whenever it likes:
// nothing waits for the window, and nothing piles up where it is slow.
class LiveRun {
 public:
  LiveRun(const RunRequest& request, const app::RunPictures& pictures);
  ~LiveRun();  // ends the run; the owner has called DrawPending() until Finished(), or no pictures are made
  LiveRun(const LiveRun&) = delete;
  LiveRun& operator=(const LiveRun&) = delete;

  void Start();
  void Control(const RunControl& control);

  // News since the last call.
  struct News {
    MapSnapshotPtr map;           // the newest of those that came
    ShownFramePtr frame;          // the same
    std::vector<Moment> moments;  // all frames that came
    RunStatus status{.active = true, .state = "starting"};
    bool finished = false;
    std::filesystem::path result;  // folder, once finished, where there is a map in it
    std::string error;             // one line, of a run that failed
    int exit_code = 0;             // of the program, as `sqslam run` ends in the same case
  };
  News Poll();
  const RunSeries& Series() const;  // of the maps until the last Poll()

  // Draws the run's pictures where it waits for them; for the thread that has OpenGL.
  void DrawPending();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sqslam::viewer
