#pragma once

#include <filesystem>
#include <memory>
#include <mutex>
#include <utility>
#include <variant>

#include "slam/snapshot/recording.h"
#include "slam/snapshot/saved_map.h"
#include "slam/snapshot/snapshot.h"
#include "slam/util/worker_thread.h"

namespace sqslam {

// Writes the snapshots of a run into map.sqmap on a thread of its own: mapping waits neither for their
// serialisation and compression nor for the disk. A full disk does not end the mapping: the thread that plays
// the frames sees the failure, stops the run and saves the rest.
class Recorder {
 public:
  Recorder(const std::filesystem::path& path, const RecordingInfo& info)
      : writer_(path, info), writing_(kMaxQueued, [this, path](const Item& item) {
          if (const auto* snapshot = std::get_if<MapSnapshotPtr>(&item)) {
            writer_.Add(**snapshot);
          } else {
            SaveMapInRecording(path, *std::get<SavedMapPtr>(item));
          }
        }) {}

  // Queues a snapshot; call in the order of the recording, one thread at a time. Blocks while the queue is
  // full, so that a slow disk does not fill the memory with maps.
  void Add(const MapSnapshotPtr& snapshot) {
    {
      const std::lock_guard lock(mutex_);
      newest_ = snapshot;
    }
    writing_.Offer(snapshot);
  }

  // Queues the live map, which replaces the previous one.
  void Keep(SavedMap map) { writing_.Offer(std::make_shared<const SavedMap>(std::move(map))); }

  // Writes all that is queued and closes the file. Throws the first failed write (InputError on a full disk);
  // nothing after it was written.
  void Close() {
    writing_.Finish();
    writer_.Close();
  }

  bool Failed() const { return writing_.Failed(); }

  // Returns the snapshot queued last; null before the first.
  MapSnapshotPtr Newest() const {
    const std::lock_guard lock(mutex_);
    return newest_;
  }

 private:
  static constexpr std::size_t kMaxQueued = 16;  // one snapshot of a large map takes tens of megabytes

  using SavedMapPtr = std::shared_ptr<const SavedMap>;
  using Item = std::variant<MapSnapshotPtr, SavedMapPtr>;

  RecordingWriter writer_;  // used by the thread while it runs, then by Close()
  WorkerThread<Item> writing_;
  mutable std::mutex mutex_;  // guards newest_
  MapSnapshotPtr newest_;
};

}  // namespace sqslam
