#include "slam/dense/live_depth.h"

#include <sys/resource.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <set>
#include <thread>
#include <utility>

#include "slam/dense/consistency.h"
#include "slam/dense/depth_estimation.h"
#include "slam/snapshot/depth_recording.h"

namespace sqslam {
namespace {

constexpr std::size_t kSettled = 10;  // keyframes after one, once its pose changes by little

std::optional<Rigid3d> PoseOf(const std::vector<PosedFrame>& frames, std::int64_t index) {
  const auto found =
      std::lower_bound(frames.begin(), frames.end(), index,
                       [](const PosedFrame& frame, std::int64_t i) { return frame.index < i; });
  return found != frames.end() && found->index == index ? std::optional(found->T_map_camera) : std::nullopt;
}

// Poses in the map as it is now of frames that were tracked in the map as it was: each moves with the
// keyframe before it.
std::vector<PosedFrame> MovedWithKeyframes(const PosesByFrame& tracked,
                                           const std::vector<PosedFrame>& keyframes) {
  std::vector<PosedFrame> frames;
  auto next = keyframes.begin();
  std::optional<Rigid3d> T_now_then;
  for (const auto& [index, T_then_camera] : tracked) {
    for (; next != keyframes.end() && next->index <= index; ++next) {
      if (const auto then = tracked.find(next->index); then != tracked.end()) {
        T_now_then = next->T_map_camera * then->second.Inverse();
      }
    }
    if (T_now_then) {
      frames.push_back({index, *T_now_then * T_then_camera});
    }
  }
  return frames;
}

// Pixels by which a point in the middle of the depths moves between two views.
double Motion(const Rigid3d& a, const Rigid3d& b, double scale_of_a, double middle, const Camera& camera) {
  const double turned = a.rotation.angularDistance(b.rotation);
  return (turned + (b.translation - scale_of_a * a.translation).norm() / middle) * camera.fx;
}

// Pixels by which rows of a frame's image are off because they were not taken at once; the correction needs a
// readout time that is known at the end of a run only.
double ShutterShift(const DenseInput& input, std::int64_t frame, double middle) {
  const std::optional<Rigid3d> before = PoseOf(input.frames, frame - 1);
  const std::optional<Rigid3d> after = PoseOf(input.frames, frame + 1);
  if (input.readout == 0.0 || !before || !after) {
    return 0.0;
  }
  const auto& frames = input.sequence.frames;
  const double seconds = frames[static_cast<std::size_t>(frame) + 1].timestamp -
                         frames[static_cast<std::size_t>(frame) - 1].timestamp;
  return Motion(Rigid3d(), before->Inverse() * *after, 1.0, middle, input.camera) / seconds * 0.5 *
         std::abs(input.readout);
}

LiveEstimate EstimateOf(const DenseInput& input, std::size_t k, const KeyframePlan& plan) {
  LiveEstimate estimate{input.ids[k], {}};
  const Rigid3d T_keyframe_map = input.keyframes[k].T_map_camera.Inverse();
  for (const std::vector<std::size_t>* views : {&plan.views, &plan.fine}) {
    for (const std::size_t view : *views) {
      estimate.T_keyframe_view[input.frames[view].index] = T_keyframe_map * input.frames[view].T_map_camera;
    }
  }
  return estimate;
}

}  // namespace

std::optional<double> ScaleIfValid(const LiveEstimate& estimate, const DenseInput& input,
                                   std::size_t keyframe, const DepthRange& range) {
  constexpr double kMostMoved = 0.5;  // pixels
  const Rigid3d T_keyframe_map = input.keyframes[keyframe].T_map_camera.Inverse();
  std::vector<std::pair<Rigid3d, Rigid3d>> poses;  // then and now
  double products = 0.0, squares = 0.0;
  for (const auto& [frame, then] : estimate.T_keyframe_view) {
    const std::optional<Rigid3d> pose = PoseOf(input.frames, frame);
    if (!pose) {
      return std::nullopt;
    }
    const Rigid3d now = T_keyframe_map * *pose;
    products += now.translation.dot(then.translation);
    squares += then.translation.squaredNorm();
    poses.emplace_back(then, now);
  }
  const double scale = products / squares;
  const double middle = 2.0 / (1.0 / range.nearest + 1.0 / range.farthest);
  for (const auto& [then, now] : poses) {
    if (!(Motion(then, now, scale, middle, input.camera) <= kMostMoved)) {
      return std::nullopt;
    }
  }
  if (ShutterShift(input, input.keyframes[keyframe].index, middle) > kMostMoved) {
    return std::nullopt;
  }
  return scale > 0.0 ? std::optional(scale) : std::nullopt;
}

struct LiveDepth::Impl {
  Impl(std::filesystem::path recording_path, const DenseOptions& dense_options)
      : path(std::move(recording_path)), options(dense_options) {}

  const std::filesystem::path path;
  const DenseOptions options;
  DenseInput input;  // of the thread, as are these
  std::optional<DepthRecording> recording;
  std::vector<LiveEstimate> estimates;
  std::set<std::int64_t> tried;  // keyframes
  std::vector<DepthMap> last;    // the depth maps made last

  std::mutex mutex;  // guards these
  std::condition_variable changed;
  MapSnapshotPtr newest;
  PosesByFrame tracked;
  bool closed = false;
  std::exception_ptr failure;
  std::thread thread;

  // Takes over the newest map and returns a keyframe of it whose turn it is. Empty: the work is to end.
  std::optional<std::size_t> Next() {
    for (;;) {
      MapSnapshotPtr map;
      PosesByFrame poses;
      {
        std::unique_lock lock(mutex);
        changed.wait(lock, [this] { return newest || closed; });
        if (closed) {
          return std::nullopt;
        }
        map = newest;
        poses = tracked;
      }
      input.TakeMap(*map, options.scale);
      input.frames = MovedWithKeyframes(poses, input.keyframes);
      for (std::size_t k = 0; k + kSettled < input.keyframes.size(); ++k) {
        if (!tried.contains(input.ids[k])) {
          return k;
        }
      }
      const std::lock_guard lock(mutex);
      if (newest == map) {
        newest.reset();  // waits for a newer one
      }
    }
  }

  void Estimate(std::size_t k) {
    tried.insert(input.ids[k]);
    std::vector<KeyframePlan> plans(input.keyframes.size());
    plans[k] = PlanKeyframe(input, k, options);
    if (!plans[k].range) {
      return;
    }
    EstimateDepthMaps(input, plans, {k}, options.stereo, 1, [&](std::size_t, const auto& map) {
      if (map) {
        Put(*map);
        estimates.push_back(EstimateOf(input, k, plans[k]));
      }
      return true;
    });
  }

  // A recording that the next state of a run may be added to at any moment.
  void Put(const DepthMap& map) {
    if (!recording) {
      recording.emplace(path, DepthRecording::Access::kBeside);
    }
    recording->PutEstimate(map, "live");
    recording->PutKept(KeepConsistent(map, last, options.fusion));
    last.push_back(map);
    if (last.size() > static_cast<std::size_t>(options.fusion.neighbours)) {
      last.erase(last.begin());
    }
  }

  void Run() {
    constexpr int kNice = 15;
    setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kNice);  // of this thread (Linux)
    try {
      while (const std::optional<std::size_t> k = Next()) {
        Estimate(*k);
      }
    } catch (...) {
      const std::lock_guard lock(mutex);
      failure = std::current_exception();
    }
  }
};

LiveDepth::LiveDepth(const std::filesystem::path& recording, Sequence sequence, const DenseOptions& options)
    : impl_(std::make_unique<Impl>(recording, options)) {
  impl_->input.sequence = std::move(sequence);
  impl_->thread = std::thread([impl = impl_.get()] { impl->Run(); });
}

LiveDepth::~LiveDepth() {
  if (impl_->thread.joinable()) {
    try {
      Finish();
    } catch (const std::exception&) {
      // Whoever cares has called Finish().
    }
  }
}

void LiveDepth::Tracked(std::int64_t frame, const Rigid3d& T_map_camera) {
  const std::lock_guard lock(impl_->mutex);
  impl_->tracked[frame] = T_map_camera;
}

void LiveDepth::Mapped(const MapSnapshotPtr& map) {
  const std::lock_guard lock(impl_->mutex);
  impl_->newest = map;
  impl_->changed.notify_all();
}

std::vector<LiveEstimate> LiveDepth::Finish() {
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->closed = true;
    impl_->changed.notify_all();
  }
  impl_->thread.join();
  impl_->recording.reset();
  if (impl_->failure) {
    std::rethrow_exception(impl_->failure);
  }
  return std::move(impl_->estimates);
}

}  // namespace sqslam
