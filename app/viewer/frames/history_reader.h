#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "app/viewer/model/object_history.h"
#include "app/viewer/model/run_series.h"

namespace sqslam::viewer {

// How objects and the run developed, over the whole recording.
struct RecordingHistory {
  ObjectHistories objects;
  RunSeries series;
};

// Reads it in one pass on a thread of its own.
class HistoryReader {
 public:
  explicit HistoryReader(const std::filesystem::path& recording);
  ~HistoryReader();  // stops the pass
  HistoryReader(const HistoryReader&) = delete;
  HistoryReader& operator=(const HistoryReader&) = delete;

  // Null until all is read, and for good where the recording is broken.
  std::shared_ptr<const RecordingHistory> Result() const;
  bool Done() const;        // with or without a result
  double Progress() const;  // [0, 1]

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sqslam::viewer
