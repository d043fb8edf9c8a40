#include "slam/localizer.h"

#include <chrono>
#include <limits>
#include <utility>

#include "slam/map/map.h"
#include "slam/mapping/mapper.h"
#include "slam/system_parts.h"
#include "slam/tracking/tracker.h"

namespace sqslam {
namespace {

// Localization makes no keyframes and begins no maps.
TrackingOptions OnlyTracking(TrackingOptions options) {
  options.submap_after = std::numeric_limits<int>::max();
  return options;
}

// Returns the atlas with the main map only.
AtlasViewPtr MainPart(const AtlasView& atlas, std::int64_t main) {
  AtlasView part;
  part.submaps[main] = atlas.submaps.at(main);
  for (const auto& [number, origin] : atlas.origins) {
    if (origin.submap == main) {
      part.origins[number] = origin;
    }
  }
  return std::make_shared<const AtlasView>(std::move(part));
}

}  // namespace

struct Localizer::Impl {
  Impl(const SavedMap& map, const std::string& name, const SystemOptions& options)
      : tracking(OnlyTracking(options.tracking)),
        vocabulary(LoadVocabularyFor(map, name, options)),
        pose_tracker(map.camera, tracking),
        tracker(map.camera, tracking, options.objects, ids, vocabulary, times) {
    Mapper mapper(map.camera, OptionsOfMapper(options), vocabulary,
                  {[this](AtlasViewPtr published) { atlas = std::move(published); }, {}, {}}, times);
    const std::int64_t main = mapper.Restore(map.state, name, ids).submap;
    atlas = MainPart(*atlas, main);
    view = atlas->submaps.at(main);
    tracker.BeginIn(atlas, main);
  }

  void Add(std::int64_t index, Localization::Pose pose, const AnchoredPose& anchor) {
    pose.T_map_camera = Resolve(anchor, view->PoseOf(anchor.reference)).T_camera_map.Inverse();
    result.poses.emplace(index, std::move(pose));
  }

  // Tracks the frames of a loss backward, from where tracking resumed.
  void AddBacklog(const Backlog& backlog) {
    for (const TrackedFrame& frame : TrackBackward(pose_tracker, *view, backlog)) {
      Add(frame.index, {{frame.timestamp, {}}, images[frame.index]}, frame.anchor);
    }
  }

  using Clock = std::chrono::steady_clock;
  TrackingOptions tracking;
  StageTimes times;
  std::shared_ptr<const Vocabulary> vocabulary;
  std::shared_ptr<IdSource> ids = std::make_shared<IdSource>();
  AtlasViewPtr atlas;
  TrackingViewPtr view;
  PoseTracker pose_tracker;
  Tracker tracker;
  std::optional<Clock::time_point> start;
  std::map<std::int64_t, std::string> images;  // of lost frames, by index
  Localization result;
};

Localizer::Localizer(const SavedMap& map, const std::string& name, const SystemOptions& options)
    : impl_(std::make_unique<Impl>(map, name, options)) {}

Localizer::~Localizer() = default;

TrackingState Localizer::Process(const Frame& frame) {
  constexpr int kNoKeyframes = std::numeric_limits<int>::max();  // waiting keyframes: prevents new ones
  Impl& s = *impl_;
  if (!s.start) {
    s.start = Impl::Clock::now();
  }
  ++s.result.frames;
  const TrackingReport report = s.tracker.Track(frame, s.atlas, kNoKeyframes);
  if (!report.pose) {
    s.images[frame.index] = frame.image_path;
    return TrackingState::kLost;
  }
  s.Add(frame.index, {{frame.timestamp, {}}, frame.image_path}, *report.pose);
  if (s.result.poses.size() == 1) {
    s.times.Add("localization.first_pose",
                std::chrono::duration<double, std::milli>(Impl::Clock::now() - *s.start).count());
  }
  if (report.backlog) {
    s.AddBacklog(*report.backlog);
  }
  s.images.clear();
  return TrackingState::kTracking;
}

Localization Localizer::Finish() {
  impl_->result.counters = impl_->tracker.Counters();
  impl_->result.timing_ms = impl_->times.Summaries();
  return std::move(impl_->result);
}

}  // namespace sqslam
