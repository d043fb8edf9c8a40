#include "slam/detection/background_detector.h"

#include <condition_variable>
#include <deque>
#include <exception>
#include <iterator>
#include <mutex>
#include <thread>
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

struct BackgroundDetector::Impl {
  Impl(Detector d, const DetectionOptions& o, bool wait)
      : detector(std::move(d)), follow(o.follow), interval(o.interval), wait_for_boxes(wait) {
    if (interval == 0) {
      interval = wait ? kDeterministicInterval : 1;
    }
    thread = std::thread([this] { Work(); });
  }

  ~Impl() {
    {
      const std::lock_guard lock(mutex);
      stopped = true;
    }
    changed.notify_all();
    thread.join();
  }

  // Number of waiting frames to work on, the last of them by the network; 0: none is due.
  std::size_t Due() const {
    for (std::size_t i = waiting.size(); i > 0; --i) {
      const bool last = finishing && i == waiting.size();
      if (last || (taken + static_cast<std::int64_t>(i) - 1) % interval == 0) {
        return i;
      }
    }
    return 0;
  }

  void Work() {
    std::unique_lock lock(mutex);
    while (true) {
      busy = false;
      changed.notify_all();
      changed.wait(lock, [&] { return stopped || Due() > 0; });
      if (stopped) {
        return;
      }
      busy = true;
      const auto end = waiting.begin() + static_cast<std::ptrdiff_t>(Due());
      const std::vector<Frame> batch(std::make_move_iterator(waiting.begin()), std::make_move_iterator(end));
      waiting.erase(waiting.begin(), end);
      taken += static_cast<std::int64_t>(batch.size());
      lock.unlock();
      std::vector<FrameBoxes> found;
      std::exception_ptr thrown;
      try {
        found = BoxesOf(batch);
      } catch (...) {
        thrown = std::current_exception();
      }
      lock.lock();
      ready.insert(ready.end(), std::make_move_iterator(found.begin()), std::make_move_iterator(found.end()));
      failure = thrown;
      stopped = stopped || thrown;
    }
  }

  // The network sees the last frame of the batch.
  std::vector<FrameBoxes> BoxesOf(const std::vector<Frame>& batch) {
    std::vector<FrameBoxes> boxes;
    for (const Frame& frame : batch) {
      boxes.push_back({frame.index, frame.timestamp, {}, false});
    }
    {
      const StageTimes::Scope timer(times, "detection");
      boxes.back().detections = detector.Detect(batch.back().bgr);
      boxes.back().seen = true;
    }
    if (follow && batch.size() > 1 && batch.size() <= kMostTracked && !last_image.empty()) {
      const StageTimes::Scope timer(times, "detection.following");
      std::vector<cv::Mat> images = {last_image};
      for (const Frame& frame : batch) {
        images.push_back(frame.gray);
      }
      std::vector<std::vector<Detection>> between = TrackBoxes(images, last_boxes, boxes.back().detections);
      for (std::size_t i = 0; i < between.size(); ++i) {
        boxes[i].detections = std::move(between[i]);
      }
    }
    last_image = batch.back().gray;
    last_boxes = boxes.back().detections;
    return boxes;
  }

  std::vector<FrameBoxes> TakeReady() {
    if (failure) {
      std::rethrow_exception(std::exchange(failure, nullptr));
    }
    return std::exchange(ready, {});
  }

  Detector detector;
  bool follow;
  std::int64_t interval;
  bool wait_for_boxes;
  StageTimes times;

  cv::Mat last_image;                 // the newest that the network has seen
  std::vector<Detection> last_boxes;  // in it

  std::mutex mutex;  // guards all below
  std::condition_variable changed;
  std::deque<Frame> waiting;
  std::vector<FrameBoxes> ready;
  std::int64_t taken = 0;  // frames, out of `waiting`
  bool busy = false;
  bool finishing = false;
  bool stopped = false;
  std::exception_ptr failure;
  std::thread thread;
};

BackgroundDetector::BackgroundDetector(Detector detector, const DetectionOptions& options, bool deterministic)
    : impl_(std::make_unique<Impl>(std::move(detector), options, deterministic)) {}

BackgroundDetector::~BackgroundDetector() = default;

void BackgroundDetector::Add(const Frame& frame) {
  Impl& s = *impl_;
  std::unique_lock lock(s.mutex);
  s.waiting.push_back(frame);
  s.changed.notify_all();
  if (s.wait_for_boxes) {
    s.changed.wait(lock, [&] { return s.stopped || (!s.busy && s.Due() == 0); });
  }
}

std::vector<FrameBoxes> BackgroundDetector::Take() {
  const std::lock_guard lock(impl_->mutex);
  return impl_->TakeReady();
}

std::vector<FrameBoxes> BackgroundDetector::Finish() {
  Impl& s = *impl_;
  std::unique_lock lock(s.mutex);
  s.finishing = true;
  s.changed.notify_all();
  s.changed.wait(lock, [&] { return s.stopped || (!s.busy && s.waiting.empty()); });
  return s.TakeReady();
}

void BackgroundDetector::WaitUntilFree(std::chrono::steady_clock::time_point deadline) {
  Impl& s = *impl_;
  std::unique_lock lock(s.mutex);
  s.changed.wait_until(lock, deadline, [&] { return s.stopped || (!s.busy && s.Due() == 0); });
}

std::map<std::string, StageTimes::Summary> BackgroundDetector::Times() const {
  return impl_->times.Summaries();
}

}  // namespace sqslam
