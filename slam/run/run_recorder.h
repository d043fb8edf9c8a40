#pragma once

#include <fmt/format.h>

#include <atomic>
#include <filesystem>
#include <mutex>
#include <string>

#include "slam/snapshot/recording.h"
#include "slam/snapshot/snapshot.h"
#include "slam/util/error.h"

namespace sqslam::app {

// Takes snapshots from the mapping thread. A disk that fills up must not end that thread: the failure is kept
// for the main thread, which then stops the run and saves the rest.
class Recorder {
 public:
  Recorder(const std::filesystem::path& path, const RecordingInfo& info) : writer_(path, info) {}

  void Add(const MapSnapshotPtr& snapshot) {
    if (failed_) {
      return;
    }
    try {
      writer_.Add(*snapshot);
    } catch (const InputError& e) {
      const std::lock_guard lock(mutex_);
      failure_ = e.what();
      failed_ = true;
    }
    keyframes_ = static_cast<int>(snapshot->keyframes.size());
    objects_ = static_cast<int>(snapshot->objects.size());
  }

  void Close() {
    if (!failed_) {
      writer_.Close();
      return;
    }
    const std::lock_guard lock(mutex_);
    throw InputError(failure_);
  }

  bool Failed() const { return failed_; }
  std::string State() const { return fmt::format("{} keyframes, {} objects", keyframes_, objects_); }

 private:
  RecordingWriter writer_;
  std::atomic<bool> failed_ = false;
  std::atomic<int> keyframes_ = 0;
  std::atomic<int> objects_ = 0;
  std::mutex mutex_;
  std::string failure_;  // guarded by mutex_
};

}  // namespace sqslam::app
