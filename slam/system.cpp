#include "slam/system.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <variant>

#include "slam/map/map.h"
#include "slam/mapping/mapper.h"
#include "slam/recognition/vocabulary.h"
#include "slam/system_parts.h"
#include "slam/tracking/tracker.h"

namespace sqslam {
namespace {

using MappingTask = std::variant<TrackingReport, SeenObjects>;

bool HasKeyframe(const MappingTask& task) {
  const auto* report = std::get_if<TrackingReport>(&task);
  return report != nullptr && report->keyframe.has_value();
}

bool BeginsMap(const MappingTask& task) {
  const auto* report = std::get_if<TrackingReport>(&task);
  return report != nullptr && report->initial_map != nullptr;
}

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
    idle_.notify_all();
    changed_.wait(lock, [&] { return closed_ || !tasks_.empty(); });
    if (tasks_.empty()) {
      return std::nullopt;
    }
    MappingTask task = std::move(tasks_.front());
    tasks_.pop_front();
    keyframe_in_work_ = HasKeyframe(task) || BeginsMap(task);
    keyframes_ -= HasKeyframe(task) ? 1 : 0;
    return task;
  }

  // Waits until no keyframe is pending, or the queue is closed.
  void WaitForKeyframes() {
    std::unique_lock lock(mutex_);
    idle_.wait(lock, [&] { return closed_ || (keyframes_ == 0 && !keyframe_in_work_); });
  }

  void Close() {
    {
      const std::lock_guard lock(mutex_);
      closed_ = true;
    }
    changed_.notify_one();
    idle_.notify_all();
  }

  // Returns the number of keyframes that were pushed and not popped yet.
  int WaitingKeyframes() const {
    const std::lock_guard lock(mutex_);
    return keyframes_;
  }

  // Returns the same including the one in work.
  int PendingKeyframes() const {
    const std::lock_guard lock(mutex_);
    return keyframes_ + (keyframe_in_work_ ? 1 : 0);
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::condition_variable idle_;
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

}  // namespace

struct System::Impl {
  Impl(const Camera& camera, const SystemOptions& system_options, std::shared_ptr<const Vocabulary> words,
       SnapshotCallback on_snapshot, const KeptCallback& on_kept)
      : options(system_options),
        vocabulary(std::move(words)),
        tracker(camera, options.tracking, options.objects, ids, vocabulary, times),
        mapper(camera, OptionsOfMapper(options), vocabulary,
               {[this](AtlasViewPtr new_view) { view.Set(std::move(new_view)); }, std::move(on_snapshot),
                [this] { return !options.deterministic && queue.WaitingKeyframes() > 0; }, KeepBy(on_kept)},
               times) {}

  std::function<void(std::string)> KeepBy(const KeptCallback& on_kept) {
    if (!on_kept) {
      return {};
    }
    return [this, on_kept](std::string state) { on_kept(Kept(std::move(state))); };
  }

  KeptMap Kept(std::string state) const {
    return {mapper.GetCamera(), vocabulary ? vocabulary->Fingerprint() : "", std::move(state)};
  }

  void BeginMapping() {
    if (!options.deterministic) {
      mapping_thread = std::thread([this] { MapInBackground(); });
    }
  }

  void BeginIn(const KeptMap& map, const std::string& name) {
    const std::int64_t main = mapper.Restore(map.state, name, ids).submap;
    tracker.BeginIn(view.Get(), main);
    end_of_map = mapper.NewestFrame();
  }

  // Renumbers a frame to follow those of the extended map.
  Frame Renumbered(Frame frame) {
    if (end_of_map && !first_frame) {
      constexpr double kGap = 1.0;  // s
      index_shift = frame.index > end_of_map->first ? 0 : end_of_map->first + 1 - frame.index;
      time_shift = frame.timestamp > end_of_map->second ? 0.0 : end_of_map->second + kGap - frame.timestamp;
    }
    frame.index += index_shift;
    frame.timestamp += time_shift;
    first_frame = first_frame.value_or(frame.timestamp);
    first_index = first_index.value_or(frame.index);
    return frame;
  }

  ~Impl() { StopMapping(); }

  void MapInBackground() {
    try {
      while (std::optional<MappingTask> task = queue.Pop()) {
        Map(std::move(*task));
      }
    } catch (...) {
      const std::lock_guard lock(failure_mutex);
      failure = std::current_exception();
    }
    queue.Close();  // nobody takes a task any more
  }

  void Map(MappingTask task) {
    std::visit([this](auto&& report) { mapper.Process(std::move(report)); }, std::move(task));
  }

  void StopMapping() {
    queue.Close();
    if (mapping_thread.joinable()) {
      mapping_thread.join();
    }
  }

  void RethrowMappingFailure() {
    const std::lock_guard lock(failure_mutex);
    if (failure) {
      std::rethrow_exception(std::exchange(failure, nullptr));
    }
  }

  SystemOptions options;
  StageTimes times;
  std::shared_ptr<const Vocabulary> vocabulary;  // null: no place recognition
  std::shared_ptr<IdSource> ids = std::make_shared<IdSource>();
  ReportQueue queue;
  ViewSlot view;
  Tracker tracker;
  Mapper mapper;
  std::optional<std::pair<std::int64_t, double>> end_of_map;  // newest frame of the extended map
  std::int64_t index_shift = 0;
  double time_shift = 0.0;            // s
  std::optional<double> first_frame;  // its timestamp
  std::optional<std::int64_t> first_index;
  int frames = 0;
  bool keyframe_due = false;  // the newest frame would have become one, had mapping been free
  std::mutex failure_mutex;
  std::exception_ptr failure;
  std::thread mapping_thread;
};

System::System(const Camera& camera, const SystemOptions& options, SnapshotCallback on_snapshot,
               KeptCallback on_kept)
    : impl_(
          std::make_unique<Impl>(camera, options, LoadVocabulary(options), std::move(on_snapshot), on_kept)) {
  impl_->BeginMapping();
}

System::System(const KeptMap& map, const std::string& name, const SystemOptions& options,
               SnapshotCallback on_snapshot, KeptCallback on_kept)
    : impl_(std::make_unique<Impl>(map.camera, options, LoadVocabularyFor(map, name, options),
                                   std::move(on_snapshot), on_kept)) {
  impl_->BeginIn(map, name);
  impl_->BeginMapping();
}

System::~System() = default;

TrackingState System::Process(const Frame& new_frame) {
  Impl& s = *impl_;
  s.RethrowMappingFailure();
  ++s.frames;
  const Frame frame = s.Renumbered(new_frame);
  const auto started = std::chrono::steady_clock::now();
  TrackingReport report = s.tracker.Track(frame, s.view.Get(), s.queue.PendingKeyframes());
  if (s.options.deterministic) {  // the recording must not depend on the clock
    s.Map(std::move(report));
  } else {
    s.keyframe_due = report.keyframe_postponed;
    report.tracking_ms =
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - started).count();
    s.queue.Push(std::move(report));
  }
  return !s.tracker.Initialized() ? TrackingState::kNotInitialized
         : s.tracker.Lost()       ? TrackingState::kLost
                                  : TrackingState::kTracking;
}

void System::WaitForMapping() {
  if (impl_->keyframe_due) {
    impl_->queue.WaitForKeyframes();
  }
}

void System::AddDetections(std::int64_t frame_index, const std::vector<Detection>& detections) {
  Impl& s = *impl_;
  s.RethrowMappingFailure();
  std::optional<SeenObjects> seen = s.tracker.AddDetections(frame_index + s.index_shift, detections);
  if (!seen) {
    return;
  }
  if (s.options.deterministic) {
    s.Map(std::move(*seen));
  } else {
    s.queue.Push(std::move(*seen));
  }
}

FrameView System::Newest() const { return impl_->tracker.Newest(); }

RunResult System::Finish() {
  Impl& s = *impl_;
  s.StopMapping();
  s.RethrowMappingFailure();
  RunResult result;
  result.frames = s.frames;
  result.readout = s.tracker.Readout();
  result.others = s.mapper.Finish();
  if (result.others.empty()) {
    result.no_map_reason = s.tracker.NoMapReason();
  } else {
    result.map = std::move(result.others.front());
    result.others.erase(result.others.begin());
    result.kept = s.Kept(s.mapper.Save());
    if (s.end_of_map && s.first_index) {
      result.added = {*s.first_index, s.index_shift, s.time_shift};
    }
  }
  result.tracked = static_cast<int>(std::ranges::count_if(result.map.trajectory, [&](const TimedPose& pose) {
    return s.first_frame && pose.timestamp >= *s.first_frame;
  }));
  result.counters = s.tracker.Counters() + s.mapper.Counters();
  result.timing_ms = s.times.Summaries();
  return result;
}

}  // namespace sqslam
