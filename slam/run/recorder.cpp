#include "slam/run/recorder.h"

#include <optional>

namespace sqslam {
namespace {

constexpr std::size_t kMaxWaiting = 16;  // one snapshot of a large map takes tens of megabytes

}  // namespace

Recorder::Recorder(const std::filesystem::path& path, const RecordingInfo& info)
    : writer_(path, info), waiting_(kMaxWaiting), thread_([this] { WriteSnapshots(); }) {}

Recorder::~Recorder() { Join(); }

void Recorder::Add(const MapSnapshotPtr& snapshot) {
  {
    const std::lock_guard lock(mutex_);
    newest_ = snapshot;
  }
  waiting_.Push(snapshot);
}

void Recorder::WriteSnapshots() {
  try {
    while (const std::optional<MapSnapshotPtr> snapshot = waiting_.Pop()) {
      writer_.Add(**snapshot);
    }
  } catch (...) {
    const std::lock_guard lock(mutex_);
    failure_ = std::current_exception();
    waiting_.Close();  // nothing more is taken, and nobody waits for room
  }
}

void Recorder::Join() {
  waiting_.Close();
  if (thread_.joinable()) {
    thread_.join();
  }
}

void Recorder::Close() {
  Join();
  if (failure_) {
    std::rethrow_exception(failure_);
  }
  writer_.Close();
}

bool Recorder::Failed() const {
  const std::lock_guard lock(mutex_);
  return failure_ != nullptr;
}

MapSnapshotPtr Recorder::Newest() const {
  const std::lock_guard lock(mutex_);
  return newest_;
}

}  // namespace sqslam
