#pragma once

#include <filesystem>
#include <memory>
#include <optional>

#include "app/viewer/frames/live_run.h"
#include "app/viewer/frames/replay.h"
#include "app/viewer/state/viewer_state.h"

namespace sqslam::viewer {

// Keeps the document: opens recordings, watches runs, and brings the frame of the present time on the screen
// and the camera before it.
class Session {
 public:
  explicit Session(ViewerState& state) : state_(state) {}

  // A recording, or the result folder that holds one. Errors become messages.
  void Open(const std::filesystem::path& path);

  // Shows a run while it goes on, and its result afterwards.
  void Watch(std::unique_ptr<LiveRun> run, const RunRequest& request);
  void Control(const RunControl& control);  // of the run, if there is one

  // Takes what is new. True where another frame of the replay is shown from now on.
  bool TakeNews();

  // Moves time on by so many seconds and asks for the frame there; true where that is another one than
  // before.
  bool RequestFrame(double seconds);

  // Frames the map with the dense cloud that is drawn with it, where that is another one than before.
  void FrameLayers();

  // Moves the camera where it moves by itself.
  void MoveCamera();

  bool Runs() const { return run_ != nullptr; }
  bool Idle() const { return (!replay_ || replay_->Idle()) && !run_; }
  // A frame is being read and nothing is there to be shown yet.
  bool Reads() const { return replay_ && !replay_->Idle() && !replay_->HasNews(); }
  int ExitCode() const { return exit_code_; }  // of the run

 private:
  void Read(const std::filesystem::path& path);
  void Close();
  void TakeRunNews();
  void FinishRun(const LiveRun::News& news);
  void TakeOpened(const OpenedRecording& opened);
  void Frame(const MapSnapshotPtr& map);

  ViewerState& state_;
  std::unique_ptr<LiveRun> run_;
  std::unique_ptr<Replay> replay_;
  std::optional<Moment> requested_;  // the last frame that was asked of the replay
  bool finished_run_ = false;        // the recording that is read is that of the run that was watched
  SceneLayers framed_layers_;        // the cloud that is framed with it
  MapSnapshotPtr framed_;            // the map before which the camera stands by itself
  int exit_code_ = 0;
};

}  // namespace sqslam::viewer
