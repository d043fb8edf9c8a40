#pragma once

#include <chrono>
#include <deque>
#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "app/viewer/input/input_events.h"
#include "app/viewer/panels/panels.h"
#include "app/viewer/session.h"
#include "app/viewer/state/pictures.h"
#include "app/viewer/state/viewer_state.h"

namespace sqslam::viewer {

// ImGui's context with its drawing, from construction to destruction.
class UserInterface {
 public:
  explicit UserInterface(double scale);
  ~UserInterface();
  UserInterface(const UserInterface&) = delete;
  UserInterface& operator=(const UserInterface&) = delete;
};

// The desktop viewer but for its window: takes events, keeps the state, draws into the framebuffer of the
// OpenGL 3.3 context that is current. Belongs to one thread; one at a time, since ImGui has one context.
class Viewer {
 public:
  explicit Viewer(cv::Size window, double scale = 1.0);
  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;

  // A recording, or the result folder that holds one. Errors become messages in the window.
  void Open(const std::filesystem::path& path);

  // Shows a run while it goes on, and its result afterwards. Closing ends it and saves.
  void Watch(std::unique_ptr<LiveRun> run, const RunRequest& request) {
    session_.Watch(std::move(run), request);
  }

  // The program's: that of the run, as `sqslam run` would end; 0 without one.
  int ExitCode() const { return session_.ExitCode(); }

  // Mouse and keys take effect with the next frame, or with a later one where a frame must come between: one
  // that sees a button or a key only as it was let go would miss the click.
  void Handle(const InputEvent& event);

  // One frame: takes what is new, draws all; `seconds` since the frame before. False where nothing was drawn:
  // without a size, or where another moment was just asked for, which the next frame will show.
  bool Frame(double seconds);

  // True if the next frame would differ from this one although no event comes.
  bool Busy() const;

  // True if nothing is being read, moving or still to be drawn finer.
  bool Idle() const;

  // True if a frame is being read and nothing else happens until it is there: drawing would only take time
  // from that.
  bool OnlyReads() const;

  bool WantsToClose() const { return closing_ && !session_.Runs(); }

  // Text that was put on the clipboard since the last call.
  std::optional<std::string> TakeClipboard() { return std::exchange(clipboard_, std::nullopt); }

  const ViewerState& State() const { return state_; }
  ViewerState& State() { return state_; }

 private:
  bool Holds(bool asked, bool news);
  bool AnyBusy() const;
  void TakeInput();
  void RunShortcuts();
  void Film(bool on);
  void FilmFrame();
  std::string Stem() const;  // of the names of files
  void Do(const OpenRequest& request);
  void Do(const ScreenshotRequest& request);
  void Do(const CopyCommandRequest& request);
  void Do(const FilmRequest& request) { Film(request.on); }
  void Do(const SaveTextRequest& request);
  void Do(const RunControl& control) { session_.Control(control); }
  void Do(const QuitRequest& request);

  UserInterface ui_;  // before all that draws
  cv::Size window_;
  ViewerState state_;
  Session session_{state_};
  EditingSession editing_;
  LayerSession layers_;
  std::vector<PanelPtr> panels_;
  std::unique_ptr<ScreenFilm> film_;
  std::optional<std::chrono::steady_clock::time_point> held_;  // since when nothing was drawn
  bool closing_ = false;
  std::optional<std::string> clipboard_;
  std::optional<Theme> applied_theme_;
  std::deque<InputEvent> waiting_;  // of mouse and keys, for the next frames
  std::vector<InputEvent> keys_;    // pressed since the last frame
};

}  // namespace sqslam::viewer
