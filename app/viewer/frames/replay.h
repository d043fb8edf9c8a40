#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "app/viewer/frames/timeline.h"
#include "app/viewer/model/run_history.h"
#include "slam/snapshot/recording.h"

namespace sqslam::viewer {

// A recording that is open.
struct OpenedRecording {
  std::filesystem::path file;
  RecordingInfo info;
  MapSnapshotPtr last;  // the finished map, whose frame all others are brought into
};

// Reads a recording on a thread of its own: first the finished map, then the time axis, then whatever frame
// is asked for; in between, what the plots show of every snapshot.
class Replay {
 public:
  // `path`: a recording, or the result folder that holds one. Errors come with Poll().
  explicit Replay(const std::filesystem::path& path);
  ~Replay();  // ends the thread
  Replay(const Replay&) = delete;
  Replay& operator=(const Replay&) = delete;

  // The frame to read next; one that has not been begun is forgotten for it.
  void Request(const Moment& moment);

  // News since the last call.
  struct News {
    std::optional<OpenedRecording> opened;
    std::optional<Timeline> timeline;                  // its series grow until `progress` is 1
    std::shared_ptr<const ObjectHistories> histories;  // once all snapshots have been read
    ShownFramePtr frame;
    double progress = 0.0;  // share of the snapshots that have been read
    std::string error;      // one line; before anything was opened nothing more comes after it

    bool Empty() const { return !opened && !timeline && !histories && !frame && error.empty(); }
  };
  News Poll();
  bool HasNews() const;
  bool Idle() const;  // nothing is being read or waits to be, and there is no news

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sqslam::viewer
