#include "slam/dense/depth_estimation.h"

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <set>
#include <thread>
#include <utility>

#include "slam/dense/image_feed.h"
#include "slam/dense/stereo.h"

namespace sqslam {
namespace {

// Estimates a keyframe's depth. Returns nothing if its images cannot be read.
std::optional<DepthMap> EstimateKeyframe(const DenseInput& input, std::size_t k, const KeyframePlan& plan,
                                         const std::map<std::int64_t, DenseImage>& images,
                                         const StereoOptions& options) {
  const PosedFrame& keyframe = input.keyframes[k];
  const auto stereo_views = [&](const std::vector<std::size_t>& chosen) {
    std::vector<StereoView> views;
    for (const std::size_t view : chosen) {
      if (const auto image = images.find(input.frames[view].index); image != images.end()) {
        views.push_back({image->second.gray, input.frames[view].T_map_camera});
      }
    }
    return views;
  };
  const auto own = images.find(keyframe.index);
  const std::vector<StereoView> views = stereo_views(plan.views);
  if (own == images.end() || views.size() < 2) {
    return std::nullopt;
  }
  DepthMap map{input.ids[k], keyframe.index, input.camera, keyframe.T_map_camera, {}, {}, own->second.bgr};
  map.depth = EstimateDepth({own->second.gray, keyframe.T_map_camera}, views, stereo_views(plan.fine),
                            input.camera, *plan.range, options);
  input.moving.Apply(map);
  return map;
}

int ThreadsFor(int asked, const StereoOptions& options, const Camera& camera) {
  constexpr double kMemory = 400e6;  // bytes for all threads
  const double bytes = (4.0 * options.planes + 60.0) * camera.width * camera.height;
  const int most = std::max(1, static_cast<int>(kMemory / bytes));
  return std::clamp(asked > 0 ? asked : static_cast<int>(std::thread::hardware_concurrency()), 1, most);
}

// Frames that each job needs, the keyframe first.
std::vector<std::vector<std::int64_t>> FramesOf(const DenseInput& input,
                                                const std::vector<KeyframePlan>& plans,
                                                const std::vector<std::size_t>& jobs) {
  std::vector<std::vector<std::int64_t>> needed;
  for (const std::size_t k : jobs) {
    std::vector<std::int64_t> frames = {input.keyframes[k].index};
    std::set<std::int64_t> others;
    for (const std::vector<std::size_t>* views : {&plans[k].views, &plans[k].fine}) {
      for (const std::size_t view : *views) {
        others.insert(input.frames[view].index);
      }
    }
    frames.insert(frames.end(), others.begin(), others.end());
    needed.push_back(std::move(frames));
  }
  return needed;
}

// Passes depth maps from the worker threads to the consumer.
class DepthQueue {
 public:
  using Entry = std::pair<std::size_t, std::optional<DepthMap>>;

  bool Put(Entry entry) {  // returns false if no more are wanted
    const std::lock_guard lock(mutex_);
    if (closed_ || failure_) {
      return false;
    }
    maps_.push_back(std::move(entry));
    changed_.notify_all();
    return true;
  }
  void Fail(std::exception_ptr failure) {
    const std::lock_guard lock(mutex_);
    failure_ = std::move(failure);
    changed_.notify_all();
  }
  Entry Take() {  // waits; rethrows the failure of a worker
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return !maps_.empty() || failure_; });
    if (failure_) {
      std::rethrow_exception(failure_);
    }
    Entry entry = std::move(maps_.front());
    maps_.pop_front();
    return entry;
  }
  void Close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Entry> maps_;
  std::exception_ptr failure_;
  bool closed_ = false;
};

}  // namespace

bool EstimateDepthMaps(const DenseInput& input, const std::vector<KeyframePlan>& plans,
                       const std::vector<std::size_t>& jobs, const StereoOptions& options, int threads,
                       const TakeDepthMap& take) {
  PosesByFrame poses;
  for (const PosedFrame& frame : input.frames) {
    poses.emplace(frame.index, frame.T_map_camera);
  }
  const ShutterCorrection shutter(input.camera, input.readout, input.sequence, std::move(poses),
                                  input.points);
  ImageFeed feed(input.sequence, input.camera, shutter, FramesOf(input, plans, jobs));
  DepthQueue queue;
  const auto work = [&] {
    try {
      while (const std::optional<ImageFeed::Job> job = feed.Next()) {
        const std::size_t k = jobs[job->index];
        if (!queue.Put({k, EstimateKeyframe(input, k, plans[k], job->images, options)})) {
          return;
        }
      }
    } catch (...) {
      queue.Fail(std::current_exception());
    }
  };
  std::vector<std::jthread> workers;
  const int count = std::min(ThreadsFor(threads, options, input.camera), static_cast<int>(jobs.size()));
  for (int i = 0; i < count; ++i) {
    workers.emplace_back(work);
  }
  bool going_on = true;
  try {
    for (std::size_t taken = 0; taken < jobs.size() && going_on; ++taken) {
      const auto [k, map] = queue.Take();
      going_on = take(k, map);
    }
  } catch (...) {
    queue.Close();
    throw;
  }
  queue.Close();
  return going_on;
}

}  // namespace sqslam
