#pragma once

#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <utility>
#include <variant>

#include "slam/map/map.h"
#include "slam/tracking/tracking_report.h"

namespace sqslam {

using MappingTask = std::variant<TrackingReport, SeenObjects>;

inline bool HasKeyframe(const MappingTask& task) {
  const auto* report = std::get_if<TrackingReport>(&task);
  return report != nullptr && report->keyframe.has_value();
}

inline bool BeginsMap(const MappingTask& task) {
  const auto* report = std::get_if<TrackingReport>(&task);
  return report != nullptr && report->initial_map != nullptr;
}

// Returns true if tracking gets another view of the map after the task.
inline bool ChangesView(const MappingTask& task) { return HasKeyframe(task) || BeginsMap(task); }

// Reports from tracking to mapping. Unbounded: reports are small except for keyframes, and the tracker makes
// no keyframe while some are waiting.
class ReportQueue {
 public:
  void Push(MappingTask task) {
    {
      const std::lock_guard lock(mutex_);
      keyframes_ += HasKeyframe(task) ? 1 : 0;
      tasks_.push_back(std::move(task));
    }
    changed_.notify_one();
  }

  // Waits for a task; returns nullopt once closed and empty.
  std::optional<MappingTask> Pop() {
    std::unique_lock lock(mutex_);
    keyframe_in_work_ = false;
    changed_.wait(lock, [&] { return closed_ || !tasks_.empty(); });
    if (tasks_.empty()) {
      return std::nullopt;
    }
    MappingTask task = std::move(tasks_.front());
    tasks_.pop_front();
    keyframe_in_work_ = ChangesView(task);
    keyframes_ -= HasKeyframe(task) ? 1 : 0;
    return task;
  }

  void Close() {
    {
      const std::lock_guard lock(mutex_);
      closed_ = true;
    }
    changed_.notify_one();
  }

  // Returns the number of keyframes that were pushed and not popped yet.
  int WaitingKeyframes() const {
    const std::lock_guard lock(mutex_);
    return keyframes_;
  }

  // Returns the same, including the keyframe being processed.
  int PendingKeyframes() const {
    const std::lock_guard lock(mutex_);
    return keyframes_ + (keyframe_in_work_ ? 1 : 0);
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<MappingTask> tasks_;
  int keyframes_ = 0;
  bool keyframe_in_work_ = false;
  bool closed_ = false;
};

// The newest value that one thread publishes and another reads.
class ViewSlot {
 public:
  void Set(AtlasViewPtr view) {
    const std::lock_guard lock(mutex_);
    view_ = std::move(view);
  }
  AtlasViewPtr Get() const {
    const std::lock_guard lock(mutex_);
    return view_;
  }

 private:
  mutable std::mutex mutex_;
  AtlasViewPtr view_;
};

// The views of the map after each of its changes. Each is for a set time of the recording, so that the same
// images give the same map, however fast the machine.
class ViewsInStep {
 public:
  // Tracking: the first view, of a map that is extended.
  void BeginWith(AtlasViewPtr view) { current_ = std::move(view); }

  // Tracking: the next view is for frames from this time on, in seconds.
  void Expect(double time) { due_.push_back(time); }

  // Tracking: returns how many views are expected.
  int Expected() const { return static_cast<int>(due_.size()); }

  // Tracking: waits for the view of the time and returns it; the one before if mapping has failed.
  AtlasViewPtr At(double time) {
    std::unique_lock lock(mutex_);
    for (; !due_.empty() && due_.front() <= time; due_.pop_front()) {
      changed_.wait(lock, [&] { return closed_ || !views_.empty(); });
      if (!views_.empty()) {
        current_ = std::move(views_.front());
        views_.pop_front();
      }
    }
    return current_;
  }

  // Mapping: the next view is there.
  void Push(AtlasViewPtr view) {
    {
      const std::lock_guard lock(mutex_);
      views_.push_back(std::move(view));
    }
    changed_.notify_one();
  }

  // Mapping: no view will follow.
  void Close() {
    {
      const std::lock_guard lock(mutex_);
      closed_ = true;
    }
    changed_.notify_one();
  }

 private:
  std::deque<double> due_;
  AtlasViewPtr current_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<AtlasViewPtr> views_;
  bool closed_ = false;
};

}  // namespace sqslam
