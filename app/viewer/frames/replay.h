#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "app/viewer/frames/timeline.h"
#include "app/viewer/model/run_history.h"
#include "slam/snapshot/recording.h"

namespace sqslam::viewer {

// An open recording.
struct OpenedRecording {
  RecordingInfo info;
  MapSnapshotPtr last;  // the finished map; all others are transformed to its frame
};

// Reads a recording on its own thread: first the finished map, then the time axis, then the requested frames
// and, in between, the plot values of every snapshot.
class Replay {
 public:
  // `path`: a recording. Errors are reported by Poll().
  explicit Replay(const std::filesystem::path& path);
  ~Replay();  // ends the thread
  Replay(const Replay&) = delete;
  Replay& operator=(const Replay&) = delete;

  // Requests the frame to read next, in place of an earlier request that has not been started.
  void Request(const Moment& moment);

  // News since the last call.
  struct News {
    std::optional<OpenedRecording> opened;
    std::optional<Timeline> timeline;                  // its series is complete once `progress` is 1
    std::shared_ptr<const ObjectHistories> histories;  // once all snapshots have been read
    ShownFramePtr frame;
    double progress = 0.0;  // share of the snapshots that have been read
    std::string error;      // one line; final if nothing was opened before it

    bool Empty() const { return !opened && !timeline && !histories && !frame && error.empty(); }
  };
  News Poll();
  bool HasNews() const;
  bool Idle() const;  // nothing is being read or requested, and no news

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sqslam::viewer
