#include "slam/detection/background_detector.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "slam/detection/box_tracking.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

constexpr int kRecordingInterval = 3;  // frames

// More frames than this between two that the network sees get no boxes: corners are rarely tracked that far,
// and tracking must not take so long that even more frames wait the next time.
constexpr std::size_t kMaxTracked = 90;

// Frees images of the first `due` frames that nothing needs: the network sees the last of them only, and
// boxes are not tracked through more than kMaxTracked. So few images wait, however long the network takes.
void FreeImages(std::deque<Frame>& frames, std::size_t due) {
  for (std::size_t i = 0; i + 1 < due; ++i) {
    frames[i].bgr.release();
    if (due > kMaxTracked) {
      frames[i].gray.release();
    }
  }
}

}  // namespace

BackgroundDetector::BackgroundDetector(std::shared_ptr<ObjectDetector> detector,
                                       const DetectionOptions& options, DetectionPace pace)
    : detector_(std::move(detector)),
      interval_(options.interval > 0               ? options.interval
                : pace == DetectionPace::kEveryNth ? kRecordingInterval
                                                   : 1),
      pace_(pace),
      thread_([this] { Work(); }) {}

BackgroundDetector::~BackgroundDetector() {
  {
    const std::lock_guard lock(mutex_);
    stopped_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

std::size_t BackgroundDetector::Due() const {
  const bool newest = pace_ == DetectionPace::kNewest;
  std::size_t due = finishing_ ? waiting_.size() : 0;
  for (std::size_t i = waiting_.size(); i > 0 && !(newest && due > 0); --i) {
    due = IsForNetwork(taken_ + static_cast<std::int64_t>(i) - 1) ? i : due;
  }
  return due;
}

void BackgroundDetector::Work() {
  std::unique_lock lock(mutex_);
  while (true) {
    busy_ = false;
    changed_.notify_all();
    changed_.wait(lock, [&] { return stopped_ || Due() > 0; });
    if (stopped_) {
      return;
    }
    busy_ = true;
    const auto end = waiting_.begin() + static_cast<std::ptrdiff_t>(Due());
    const std::vector<Frame> batch(std::make_move_iterator(waiting_.begin()), std::make_move_iterator(end));
    waiting_.erase(waiting_.begin(), end);
    taken_ += static_cast<std::int64_t>(batch.size());
    lock.unlock();
    std::vector<FrameBoxes> found;
    std::exception_ptr thrown;
    try {
      found = BoxesOf(batch);
    } catch (...) {
      thrown = std::current_exception();
    }
    lock.lock();
    std::ranges::move(found, std::back_inserter(ready_));
    failure_ = thrown;
    stopped_ = stopped_ || thrown;
  }
}

std::vector<FrameBoxes> BackgroundDetector::BoxesOf(const std::vector<Frame>& batch) {
  std::vector<FrameBoxes> boxes = ToVector(batch, [](const Frame& frame) {
    return FrameBoxes{frame.index, frame.timestamp, {}, false, frame.quarter_turns};
  });
  {
    const StageTimes::Scope timer(times_, "detection");
    boxes.back().detections = DetectIn(batch.back(), *detector_);
    boxes.back().seen = true;
  }
  if (batch.size() > 1 && batch.size() <= kMaxTracked && !last_image_.empty()) {
    const StageTimes::Scope timer(times_, "detection.following");
    std::vector<cv::Mat> images = {last_image_};
    std::ranges::transform(batch, std::back_inserter(images), &Frame::gray);
    std::vector<std::vector<Detection>> between = TrackBoxes(images, last_boxes_, boxes.back().detections);
    for (std::size_t i = 0; i < between.size(); ++i) {
      boxes[i].detections = std::move(between[i]);
    }
  }
  last_image_ = batch.back().gray;
  last_boxes_ = boxes.back().detections;
  return boxes;
}

std::vector<FrameBoxes> BackgroundDetector::TakeReady() {
  if (failure_) {
    std::rethrow_exception(std::exchange(failure_, nullptr));
  }
  return std::exchange(ready_, {});
}

std::vector<FrameBoxes> BackgroundDetector::Add(const Frame& frame) {
  std::unique_lock lock(mutex_);
  const bool for_network = IsForNetwork(taken_ + static_cast<std::int64_t>(waiting_.size()));
  if (pace_ == DetectionPace::kEveryNth && for_network) {
    changed_.wait(lock, [&] { return stopped_ || (!busy_ && Due() == 0); });
  }
  std::vector<FrameBoxes> boxes;
  if (pace_ == DetectionPace::kNewest || for_network) {
    boxes = TakeReady();
  }
  waiting_.push_back(frame);
  if (pace_ == DetectionPace::kNewest) {
    FreeImages(waiting_, Due());
  }
  changed_.notify_all();
  return boxes;
}

std::vector<FrameBoxes> BackgroundDetector::Finish() {
  std::unique_lock lock(mutex_);
  finishing_ = true;
  changed_.notify_all();
  changed_.wait(lock, [&] { return stopped_ || (!busy_ && waiting_.empty()); });
  return TakeReady();
}

}  // namespace sqslam
