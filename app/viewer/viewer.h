#pragma once

#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

#include "app/viewer/frames/live_run.h"
#include "app/viewer/input/input_events.h"
#include "app/viewer/state/viewer_state.h"

namespace sqslam::viewer {

// The desktop viewer but for its window: takes events, keeps the state, draws into the framebuffer of the
// OpenGL 3.3 context that is current. Belongs to one thread; one at a time, since ImGui has one context.
class Viewer {
 public:
  explicit Viewer(cv::Size window, double ui_scale = 1.0);
  ~Viewer();
  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;

  // A recording, or the result folder that holds one. What is wrong with it is shown in the window.
  void Open(const std::filesystem::path& path);

  // Shows a run while it goes on, and its result afterwards. Closing ends it and saves.
  void Watch(std::unique_ptr<LiveRun> run, const app::RunRequest& request);

  // Of the program: that of the run, as `sqslam run` would end; 0 without one.
  int ExitCode() const;

  void Handle(const InputEvent& event);

  // One frame: takes what is new, draws all; `seconds` since the frame before. False where nothing was drawn:
  // without a size, or where another moment was just asked for, which the next frame will show.
  bool Frame(double seconds);

  // Whether the next frame would differ from this one although no event comes.
  bool Busy() const;

  // Whether nothing is being read, moving or still to be drawn finer.
  bool Idle() const;

  // Whether a frame is being read and nothing else happens until it is there: drawing would only take time
  // from that.
  bool OnlyReads() const;

  bool WantsToClose() const;

  // Text that a panel put on the clipboard since the last call.
  std::optional<std::string> TakeClipboard();

  const ViewerState& State() const;
  ViewerState& State();

  struct Impl;

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace sqslam::viewer
