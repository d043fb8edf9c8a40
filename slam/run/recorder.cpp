#include "slam/run/recorder.h"

namespace sqslam {
namespace {

constexpr std::size_t kMaxWaiting = 16;  // one snapshot of a large map takes tens of megabytes

}  // namespace

Recorder::Recorder(const std::filesystem::path& path, const RecordingInfo& info)
    : writer_(path, info),
      writing_(kMaxWaiting, [this](const MapSnapshotPtr& snapshot) { writer_.Add(*snapshot); }) {}

void Recorder::Add(const MapSnapshotPtr& snapshot) {
  {
    const std::lock_guard lock(mutex_);
    newest_ = snapshot;
  }
  writing_.Offer(snapshot);
}

void Recorder::Close() {
  writing_.Finish();
  writer_.Close();
}

MapSnapshotPtr Recorder::Newest() const {
  const std::lock_guard lock(mutex_);
  return newest_;
}

}  // namespace sqslam
