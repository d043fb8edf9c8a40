#pragma once

#include <filesystem>
#include <memory>
#include <mutex>
#include <utility>
#include <variant>

#include "slam/snapshot/kept_map.h"
#include "slam/snapshot/recording.h"
#include "slam/snapshot/snapshot.h"
#include "slam/util/worker_thread.h"

namespace sqslam {

// Writes the snapshots of a run into map.sqmap on a thread of its own: mapping waits neither for their
// serialisation and compression nor for the disk. A disk that fills up does not end the mapping: the failure
// is kept for the thread that plays the frames, which stops the run and saves the rest.
class Recorder {
 public:
  Recorder(const std::filesystem::path& path, const RecordingInfo& info)
      : writer_(path, info), writing_(kMaxWaiting, [this, path](const Item& item) {
          if (const auto* snapshot = std::get_if<MapSnapshotPtr>(&item)) {
            writer_.Add(**snapshot);
          } else {
            KeepInRecording(path, *std::get<KeptMapPtr>(item));
          }
        }) {}

  // Queues a snapshot; from one thread at a time, in the order of the recording. Waits while the queue is
  // full, so that a slow disk does not fill the memory with maps.
  void Add(const MapSnapshotPtr& snapshot) {
    {
      const std::lock_guard lock(mutex_);
      newest_ = snapshot;
    }
    writing_.Offer(snapshot);
  }

  // Queues the live map, which takes the place of the one kept before.
  void Keep(KeptMap map) { writing_.Offer(std::make_shared<const KeptMap>(std::move(map))); }

  // Writes what still waits and closes the file. Throws the failure of the first snapshot that could not be
  // written (InputError on a full disk); none after it was.
  void Close() {
    writing_.Finish();
    writer_.Close();
  }

  bool Failed() const { return writing_.Failed(); }

  // The one queued last; null before the first.
  MapSnapshotPtr Newest() const {
    const std::lock_guard lock(mutex_);
    return newest_;
  }

 private:
  static constexpr std::size_t kMaxWaiting = 16;  // one snapshot of a large map takes tens of megabytes

  using KeptMapPtr = std::shared_ptr<const KeptMap>;
  using Item = std::variant<MapSnapshotPtr, KeptMapPtr>;

  RecordingWriter writer_;  // of the thread while it runs, then of whoever has joined it
  WorkerThread<Item> writing_;
  mutable std::mutex mutex_;  // guards the next
  MapSnapshotPtr newest_;
};

}  // namespace sqslam
