#pragma once

#include <filesystem>
#include <memory>
#include <optional>

#include "app/viewer/frames/live_run.h"
#include "app/viewer/frames/replay.h"
#include "app/viewer/state/viewer_state.h"

namespace sqslam::viewer {

// Maintains the document: opens recordings, watches runs, requests frames. Also moves the camera.
class Session {
 public:
  explicit Session(ViewerState& state) : state_(state) {}

  // Opens a recording, or the result folder that holds one. Errors become messages.
  void Open(const std::filesystem::path& path);

  // Shows a run in progress, then its result.
  void Watch(std::unique_ptr<LiveRun> run, const RunRequest& request);
  void Control(const RunControl& control);  // no effect without a run

  // Takes news of the run or replay. Returns true if a new frame of the replay was received.
  bool TakeNews();

  // Advances playback by `seconds` and requests the frame there. Returns true if that is a new one.
  bool RequestFrame(double seconds);

  // Frames the map together with its dense cloud if the drawn cloud has changed.
  void FrameLayers();

  // Moves the camera in the modes in which it moves by itself.
  void MoveCamera();

  bool Runs() const { return run_ != nullptr; }
  bool Idle() const { return (!replay_ || replay_->Idle()) && !run_; }
  // Returns true if a frame is being read and there is nothing new to show yet.
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
  std::optional<Moment> requested_;  // the last frame requested from the replay
  bool finished_run_ = false;        // the recording being read is the result of the watched run
  SceneLayers framed_layers_;        // the layers included in the framing
  MapSnapshotPtr framed_;            // the map for which the camera was last placed
  int exit_code_ = 0;
};

}  // namespace sqslam::viewer
