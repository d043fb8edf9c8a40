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
#include "app/viewer/widgets/widgets.h"

namespace sqslam::viewer {

// Owns the ImGui context and its OpenGL back end.
class UserInterface {
 public:
  explicit UserInterface(double scale);
  ~UserInterface();
  UserInterface(const UserInterface&) = delete;
  UserInterface& operator=(const UserInterface&) = delete;

 private:
  std::vector<ShownLabel> labels_;  // of the last frame
};

// The desktop viewer without its window: takes events, holds the state, draws into the framebuffer of the
// current OpenGL 3.3 context. Must stay on one thread; only one may exist, since ImGui has one context.
class Viewer {
 public:
  explicit Viewer(cv::Size window, double scale = 1.0);
  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;

  // Opens a recording, or the result folder that holds one. Errors become messages in the window.
  void Open(const std::filesystem::path& path);

  // Shows a run in progress, then its result. Closing the window ends the run and saves its map.
  void Watch(std::unique_ptr<LiveRun> run, const RunRequest& request) {
    session_.Watch(std::move(run), request);
  }

  // Returns the exit code of the program: as of `sqslam run` after a run, else 0.
  int ExitCode() const { return session_.ExitCode(); }

  // Mouse and key events take effect in the next frame, or a later one if they need a frame in between: a
  // frame that sees a press and its release at once would miss the click.
  void Handle(const InputEvent& event);

  // Draws one frame, `seconds` after the one before. Returns false if nothing was drawn: the window has no
  // size, or a new frame of the replay was just requested and will be shown next.
  bool Frame(double seconds);

  // Returns true if the next frame would differ from this one even without an event.
  bool Busy() const;

  // Returns true if nothing is being read or moving, and nothing is left to be drawn in finer detail.
  bool Idle() const;

  bool WantsToClose() const { return closing_ && !session_.Runs(); }

  // Returns the text that was put on the clipboard since the last call.
  std::optional<std::string> TakeClipboard() { return std::exchange(clipboard_, std::nullopt); }

  const ViewerState& State() const { return state_; }
  ViewerState& State() { return state_; }

 private:
  bool Holds(bool asked, bool news);
  void TakeInput();
  void RunShortcuts();
  void Film(bool on);
  void FilmFrame();
  std::string Stem() const;  // of file names
  void Do(const OpenRequest& request);
  void Do(const ScreenshotRequest& request);
  void Do(const CopyCommandRequest& request);
  void Do(const FilmRequest& request) { Film(request.on); }
  void Do(const SaveTextRequest& request);
  void Do(const RunControl& control) { session_.Control(control); }
  void Do(const QuitRequest& request);

  UserInterface ui_;  // constructed before all that draws
  cv::Size window_;
  ViewerState state_;
  Session session_{state_};
  EditingSession editing_;
  LayerSession layers_;
  std::vector<PanelPtr> panels_;
  std::unique_ptr<ScreenFilm> film_;
  std::optional<std::chrono::steady_clock::time_point> held_;  // since when drawing is held back
  bool closing_ = false;
  std::optional<std::string> clipboard_;
  std::optional<Theme> applied_theme_;
  std::deque<InputEvent> waiting_;  // mouse and key events for the next frames
  std::vector<InputEvent> keys_;    // pressed since the last frame
};

}  // namespace sqslam::viewer
