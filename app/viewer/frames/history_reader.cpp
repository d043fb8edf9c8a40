#include "app/viewer/frames/history_reader.h"

#include <atomic>
#include <mutex>
#include <thread>
#include <utility>

#include "slam/util/error.h"

namespace sqslam::viewer {

struct HistoryReader::Impl {
  explicit Impl(std::filesystem::path file) : path(std::move(file)), thread([this] { Work(); }) {}

  void Work() {
    try {
      const RecordingReader reader(path);
      auto history = std::make_shared<RecordingHistory>();
      for (int i = 0; i < reader.Size() && !ending; ++i) {
        try {
          const MapSnapshotPtr map = reader.Read(i);
          history->objects.Add(i, *map);
          history->series.Add(*map);
        } catch (const InputError&) {  // whoever shows the map says so
        }
        progress = (i + 1.0) / reader.Size();
      }
      if (!ending) {
        const std::lock_guard lock(mutex);
        result = std::move(history);
      }
    } catch (const std::exception&) {  // whoever shows the map says so
    }
    done = true;
  }

  std::filesystem::path path;
  std::atomic<bool> ending = false;
  std::atomic<bool> done = false;
  std::atomic<double> progress = 0.0;
  mutable std::mutex mutex;
  std::shared_ptr<const RecordingHistory> result;  // guarded by mutex
  std::thread thread;
};

HistoryReader::HistoryReader(const std::filesystem::path& recording)
    : impl_(std::make_unique<Impl>(recording)) {}

HistoryReader::~HistoryReader() {
  impl_->ending = true;
  impl_->thread.join();
}

std::shared_ptr<const RecordingHistory> HistoryReader::Result() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->result;
}

bool HistoryReader::Done() const { return impl_->done; }
double HistoryReader::Progress() const { return impl_->progress; }

}  // namespace sqslam::viewer
