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

// A run of the pipeline on its own threads. The window polls the newest state at its own pace: the run never
// waits for the window, and nothing queues up if the window is slow.
class LiveRun {
 public:
  LiveRun(const RunRequest& request, const app::RunPictures& pictures);
  ~LiveRun();  // ends the run; pictures that DrawPending() has not drawn are left out
  LiveRun(const LiveRun&) = delete;
  LiveRun& operator=(const LiveRun&) = delete;

  void Start();
  void Control(const RunControl& control);

  // News since the last call.
  struct News {
    MapSnapshotPtr map;           // the newest one
    RunSeries series;             // of the maps until now, if there is a new one
    ShownFramePtr frame;          // the newest one
    std::vector<Moment> moments;  // all new frames
    RunStatus status{.active = true, .state = "starting"};
    bool finished = false;
    std::filesystem::path result;  // result folder, once finished, if it holds a map
    std::string error;             // one line, if the run failed
    int exit_code = 0;             // as of `sqslam run`
  };
  News Poll();

  // Draws the run's pictures if it waits for them; must be called on the thread with the OpenGL context.
  void DrawPending();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sqslam::viewer
