#include "slam/system.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <mutex>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <thread>
#include <utility>
#include <variant>

#include "slam/io/image_files.h"
#include "slam/map/map.h"
#include "slam/mapping/mapper.h"
#include "slam/recognition/vocabulary.h"
#include "slam/system_parts.h"
#include "slam/system_queues.h"
#include "slam/tracking/tracker.h"

namespace sqslam {
struct System::Impl {
  Impl(const Camera& camera, const SystemOptions& system_options, std::shared_ptr<const Vocabulary> words,
       SnapshotCallback on_snapshot, const KeptCallback& on_kept)
      : options(system_options),
        vocabulary(std::move(words)),
        tracker(camera, options.tracking, options.objects, ids, vocabulary, times),
        mapper(camera, OptionsOfMapper(options), vocabulary,
               {[this](AtlasViewPtr new_view) { view.Set(std::move(new_view)); }, std::move(on_snapshot),
                [this] { return !Repeatable() && queue.WaitingKeyframes() > 0; }, KeepBy(on_kept),
                [size = cv::Size(camera.width, camera.height)](const std::string& path, bool in_color) {
                  return path.empty() ? cv::Mat()
                                      : ReadImageInSize(path, size,
                                                        in_color ? cv::IMREAD_COLOR : cv::IMREAD_GRAYSCALE);
                }},
               times, ids) {}

  std::function<void(std::string)> KeepBy(const KeptCallback& on_kept) {
    if (!on_kept) {
      return {};
    }
    return [this, on_kept](std::string state) { on_kept(Kept(std::move(state))); };
  }

  SavedMap Kept(std::string state) const {
    return {mapper.GetCamera(), vocabulary ? vocabulary->Fingerprint() : "", std::move(state)};
  }

  bool Repeatable() const { return options.deterministic || options.in_step; }

  void BeginMapping() {
    if (!options.deterministic) {
      mapping_thread = std::thread([this] { MapInBackground(); });
    }
  }

  void BeginIn(const SavedMap& map, const std::string& name) {
    const std::int64_t main = mapper.Restore(map.state, name, ids).submap;
    views.BeginWith(view.Get());
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
        const bool changes_view = ChangesView(*task);
        Map(std::move(*task));
        if (options.in_step && changes_view) {
          views.Push(view.Get());
        }
      }
    } catch (...) {
      const std::lock_guard lock(failure_mutex);
      failure = std::current_exception();
    }
    views.Close();
    queue.Close();  // nobody takes a task any more
  }

  TrackingReport Track(const Frame& frame) {
    if (!options.in_step || options.deterministic) {
      return tracker.Track(frame, view.Get(), queue.PendingKeyframes());
    }
    // Counted before the view is taken: a frame that first sees a new view asks for keyframes that the next
    // one does not need, twice as many in all.
    const int pending = views.Expected();
    TrackingReport report = tracker.Track(frame, views.At(frame.timestamp), pending);
    if (report.keyframe || report.initial_map) {
      views.Expect(frame.timestamp + options.tracking.keyframes.mapped_after);
    }
    return report;
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
  ViewsInStep views;
  Tracker tracker;
  Mapper mapper;
  std::optional<std::pair<std::int64_t, double>> end_of_map;  // newest frame of the extended map
  std::int64_t index_shift = 0;
  double time_shift = 0.0;            // s
  std::optional<double> first_frame;  // its timestamp
  std::optional<std::int64_t> first_index;
  int frames = 0;
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

System::System(const SavedMap& map, const std::string& name, const SystemOptions& options,
               SnapshotCallback on_snapshot, KeptCallback on_kept)
    : impl_(std::make_unique<Impl>(map.camera, options, LoadVocabularyFor(map, name, options),
                                   std::move(on_snapshot), on_kept)) {
  impl_->BeginIn(map, name);
  impl_->BeginMapping();
}

System::~System() = default;

void System::Expect(const Frame& frame) { impl_->tracker.Expect(impl_->Renumbered(frame)); }

TrackingState System::Process(const Frame& new_frame) {
  Impl& s = *impl_;
  s.RethrowMappingFailure();
  ++s.frames;
  const Frame frame = s.Renumbered(new_frame);
  const auto started = std::chrono::steady_clock::now();
  TrackingReport report = s.Track(frame);
  if (s.options.deterministic) {  // the recording must not depend on the clock
    s.Map(std::move(report));
  } else {
    report.tracking_ms =
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - started).count();
    s.queue.Push(std::move(report));
  }
  return !s.tracker.Initialized() ? TrackingState::kNotInitialized
         : s.tracker.Lost()       ? TrackingState::kLost
                                  : TrackingState::kTracking;
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

RunResult System::Finish(const std::function<bool()>& stop) {
  Impl& s = *impl_;
  s.StopMapping();
  s.RethrowMappingFailure();
  RunResult result;
  result.frames = s.frames;
  result.readout = s.tracker.Readout();
  result.others = s.mapper.Finish(stop);
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
