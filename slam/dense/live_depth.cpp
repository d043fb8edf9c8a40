#include "slam/dense/live_depth.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/resource.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <set>
#include <sstream>
#include <thread>
#include <utility>
#include <vector>

#include "slam/dense/depth_estimation.h"
#include "slam/dense/depth_fusion.h"
#include "slam/snapshot/depth_recording.h"

namespace sqslam {
namespace {

constexpr std::size_t kSettledAfter = 10;  // keyframes until a pose has settled

std::optional<Rigid3d> PoseOf(const std::vector<PosedFrame>& frames, std::int64_t index) {
  const auto found = std::ranges::lower_bound(frames, index, {}, &PosedFrame::index);
  return found != frames.end() && found->index == index ? std::optional(found->T_map_camera) : std::nullopt;
}

// Moves poses from the map that they were tracked in to the present one, each with the keyframe before it.
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

// Returns the pixels by which a point at the middle depth moves between two views.
double Motion(const Rigid3d& a, const Rigid3d& b, double scale_of_a, double middle, const Camera& camera) {
  const double turned = a.rotation.angularDistance(b.rotation);
  return (turned + (b.translation - scale_of_a * a.translation).norm() / middle) * camera.fx;
}

// Returns the pixels by which the rolling shutter shifts rows of a frame. Live estimates don't correct it,
// because the readout time is known only at the end of a run.
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

LiveEstimate EstimateOf(const DenseInput& input, std::size_t k, const KeyframePlan& plan,
                        const DenseOptions& options) {
  LiveEstimate estimate{EstimationSettings(options), {}};
  const Rigid3d T_keyframe_map = input.keyframes[k].T_map_camera.Inverse();
  for (const std::vector<std::size_t>* views : {&plan.views, &plan.fine}) {
    for (const std::size_t view : *views) {
      estimate.T_keyframe_view[input.frames[view].index] = T_keyframe_map * input.frames[view].T_map_camera;
    }
  }
  return estimate;
}

constexpr const char* kLive = "live";  // first word of a live estimate's text

}  // namespace

std::string LiveEstimate::Text() const {
  std::string text = fmt::format("{} {}", kLive, settings);
  for (const auto& [frame, pose] : T_keyframe_view) {
    text += fmt::format("\n{} {} {}", frame, fmt::join(pose.rotation.coeffs(), " "),
                        fmt::join(pose.translation, " "));
  }
  return text;
}

std::optional<LiveEstimate> LiveEstimate::FromText(const std::string& text) {
  std::istringstream words(text);
  std::string kind;
  LiveEstimate estimate;
  if (!(words >> kind >> estimate.settings) || kind != kLive) {
    return std::nullopt;
  }
  std::int64_t frame = 0;
  while (words >> frame) {
    Eigen::Vector4d q;
    Rigid3d pose;
    for (double* value :
         {&q[0], &q[1], &q[2], &q[3], &pose.translation[0], &pose.translation[1], &pose.translation[2]}) {
      if (!(words >> *value)) {
        return std::nullopt;
      }
    }
    pose.rotation.coeffs() = q;
    estimate.T_keyframe_view[frame] = pose;
  }
  return estimate.T_keyframe_view.empty() ? std::nullopt : std::optional(estimate);
}

std::optional<double> ScaleIfValid(const LiveEstimate& estimate, const DenseInput& input,
                                   std::size_t keyframe, const DepthRange& range) {
  constexpr double kMaxMotion = 0.5;  // pixels
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
    if (!(Motion(then, now, scale, middle, input.camera) <= kMaxMotion)) {
      return std::nullopt;
    }
  }
  if (ShutterShift(input, input.keyframes[keyframe].index, middle) > kMaxMotion) {
    return std::nullopt;
  }
  return scale > 0.0 ? std::optional(scale) : std::nullopt;
}

struct LiveDepth::Impl {
  Impl(std::filesystem::path recording_path, const DenseOptions& dense_options)
      : path(std::move(recording_path)), options(dense_options) {}

  const std::filesystem::path path;
  const DenseOptions options;
  DenseInput input;  // owned by the thread, like the following
  std::optional<DepthRecording> recording;
  PosesByFrame tracked;
  int made = 0;                  // depth maps
  std::set<std::int64_t> tried;  // keyframes
  std::vector<DepthMap> last;    // the latest depth maps

  std::mutex mutex;  // guards the following; held briefly, since tracking must not wait for the thread
  std::condition_variable changed;
  MapSnapshotPtr newest;
  std::vector<PosedFrame> fresh;  // frames tracked since the thread last looked
  bool closed = false;
  std::exception_ptr failure;
  std::thread thread;

  // Takes over the newest map and returns its next keyframe to estimate, or nothing if the work is to end.
  std::optional<std::size_t> Next() {
    for (;;) {
      MapSnapshotPtr map;
      std::vector<PosedFrame> frames;
      {
        std::unique_lock lock(mutex);
        changed.wait(lock, [this] { return newest || closed; });
        if (closed) {
          return std::nullopt;
        }
        map = newest;
        frames.swap(fresh);
      }
      for (const PosedFrame& frame : frames) {
        tracked[frame.index] = frame.T_map_camera;
      }
      input.SetMap(*map, options.scale);
      input.frames = MovedWithKeyframes(tracked, input.keyframes);
      for (std::size_t k = 0; k + kSettledAfter < input.keyframes.size(); ++k) {
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
        Put(*map, EstimateOf(input, k, plans[k], options));
        ++made;
      }
      return true;
    });
  }

  // Opens the recording beside its writer: the run may add its next state at any moment.
  void Put(const DepthMap& map, const LiveEstimate& estimate) {
    if (!recording) {
      recording.emplace(path, DepthRecording::Access::kBeside);
    }
    recording->PutEstimate(map, estimate.Text());
    recording->PutKept(KeepConsistent(map, last, options.fusion));
    last.push_back(map);
    if (last.size() > std::size_t{kNeighbours}) {
      last.erase(last.begin());
    }
  }

  void Run() {
    constexpr int kNice = 15;
    setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kNice);  // this thread only (Linux)
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
      // The error is only reported to those who call Finish().
    }
  }
}

void LiveDepth::Tracked(std::int64_t frame, const Rigid3d& T_map_camera) {
  const std::lock_guard lock(impl_->mutex);
  impl_->fresh.push_back({frame, T_map_camera});
}

void LiveDepth::Mapped(const MapSnapshotPtr& map) {
  const std::lock_guard lock(impl_->mutex);
  impl_->newest = map;
  impl_->changed.notify_all();
}

int LiveDepth::Finish() {
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
  return impl_->made;
}

}  // namespace sqslam
