#include "slam/detection/background_detector.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "slam/detection/box_tracking.h"

namespace sqslam {
namespace {

constexpr int kDeterministicInterval = 3;  // frames

// A network so slow that more frames than these lie between two that it sees leaves them without boxes:
// corners are rarely tracked that far, and tracking must not take so long that even more frames wait the next
// time.
constexpr std::size_t kMostTracked = 90;

}  // namespace

BackgroundDetector::BackgroundDetector(Detector detector, const DetectionOptions& options, bool deterministic)
    : detector_(std::move(detector)),
      follow_(options.follow),
      interval_(options.interval > 0 ? options.interval
                : deterministic      ? kDeterministicInterval
                                     : 1),
      wait_for_boxes_(deterministic),
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
  for (std::size_t i = waiting_.size(); i > 0; --i) {
    const bool last = finishing_ && i == waiting_.size();
    if (last || (taken_ + static_cast<std::int64_t>(i) - 1) % interval_ == 0) {
      return i;
    }
  }
  return 0;
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
  std::vector<FrameBoxes> boxes;
  for (const Frame& frame : batch) {
    boxes.push_back({frame.index, frame.timestamp, {}, false});
  }
  {
    const StageTimes::Scope timer(times_, "detection");
    boxes.back().detections = detector_.Detect(batch.back().bgr);
    boxes.back().seen = true;
  }
  if (follow_ && batch.size() > 1 && batch.size() <= kMostTracked && !last_image_.empty()) {
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

void BackgroundDetector::Add(const Frame& frame) {
  std::unique_lock lock(mutex_);
  waiting_.push_back(frame);
  changed_.notify_all();
  if (wait_for_boxes_) {
    changed_.wait(lock, [&] { return IsFree(); });
  }
}

std::vector<FrameBoxes> BackgroundDetector::Take() {
  const std::lock_guard lock(mutex_);
  return TakeReady();
}

std::vector<FrameBoxes> BackgroundDetector::Finish() {
  std::unique_lock lock(mutex_);
  finishing_ = true;
  changed_.notify_all();
  changed_.wait(lock, [&] { return stopped_ || (!busy_ && waiting_.empty()); });
  return TakeReady();
}

void BackgroundDetector::WaitUntilFree(std::chrono::steady_clock::time_point deadline) {
  std::unique_lock lock(mutex_);
  changed_.wait_until(lock, deadline, [&] { return IsFree(); });
}

}  // namespace sqslam
