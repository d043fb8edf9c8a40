// The end of a run: leftovers are tried once more, then every submap gets its last adjustment.
#include <algorithm>
#include <ranges>

#include "slam/mapping/local_mapping.h"
#include "slam/mapping/mapper.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

using Kind = CompletionAttempts::Kind;

constexpr int kMinSubmapKeyframes = 5;  // a submap with fewer is dropped, unless there is no other
constexpr int kFinalIterations = 10;    // of the bundle adjustment over a whole submap

// Returns true if the frame shows enough that its reference keyframe does not.
bool AddsToMap(const Map& map, const TrackedFrame& frame) {
  constexpr double kMaxTrackedShare = 0.8;  // of the points of the reference
  auto points = map.At(frame.anchor.reference).SeenPoints();
  const auto seen = static_cast<double>(std::distance(points.begin(), points.end()));
  return frame.inliers < kMaxTrackedShare * seen;
}

}  // namespace

// Returns all submaps, the one with the most frames first.
std::vector<Submap*> Mapper::RankedSubmaps() {
  std::vector<Submap*> ranked =
      ToVector(submaps_ | std::views::values, [](Submap& submap) { return &submap; });
  std::ranges::stable_sort(
      ranked, [](const Submap* a, const Submap* b) { return a->Frames().size() > b->Frames().size(); });
  return ranked;
}

void Mapper::Complete(const std::function<bool()>& stop) {
  constexpr int kMaxRounds = 5;
  for (const std::int64_t index : leftovers_.Indices()) {
    if (HasFrame(index)) {
      leftovers_.Remove(index);
    }
  }
  if (options_.mapping.completion.max_frames == 0 || (leftovers_.ByIndex().empty() && submaps_.size() == 1)) {
    return;
  }
  const StageTimes::Scope timer(times_, "mapping.completion");
  const Completion completion(camera_, pose_tracker_, places_);
  CompletionAttempts attempts(stop);
  bool progress = true;
  for (int round = 0; progress && round < kMaxRounds; ++round) {
    progress = TieLeftoverSubmaps(completion, attempts);
    if (round == 0) {
      DissolveSmallSubmaps();
    }
    for (Submap* submap : RankedSubmaps()) {
      progress = PlaceLeftovers(completion, *submap, attempts) || progress;
    }
  }
}

// Merges submaps, the largest first, until no two of them share a recognised place.
bool Mapper::TieLeftoverSubmaps(const Completion& completion, CompletionAttempts& attempts) {
  bool any = false;
  bool tied = true;
  while (tied && submaps_.size() > 1) {
    tied = false;
    const std::vector<Submap*> ranked = RankedSubmaps();
    for (std::size_t i = 0; i < ranked.size() && !tied; ++i) {
      const TrackingViewPtr view = ranked[i]->MakeView();
      for (std::size_t j = i + 1; j < ranked.size() && !tied; ++j) {
        const auto tie = attempts.Try(Kind::kTie, ranked[i]->Number(), ranked[j]->Number(), [&] {
          return completion.Tie(ranked[j]->Map(), ranked[i]->Map(), *view);
        });
        if (!tie) {
          continue;
        }
        active_ = ranked[j];
        MergeSubmaps(tie->loop, *ranked[i]);
        active_->Deform([this](sqslam::Map&) { OptimizeGlobally(false); });
        attempts.ForgetFailuresIn(active_->Number());
        ++counters_.merges;
        ++counters_.tied_at_end;
        any = tied = true;
      }
    }
  }
  return any;
}

// Drops submaps that never grew: their frames may still be located in others one by one.
void Mapper::DissolveSmallSubmaps() {
  const std::vector<Submap*> ranked = RankedSubmaps();
  for (Submap* submap : ranked | std::views::drop(1)) {
    const auto& keyframes = submap->Map().Keyframes();
    if (static_cast<int>(keyframes.size()) < kMinSubmapKeyframes) {
      for (const auto& [id, keyframe] : keyframes) {
        leftovers_.Add({keyframe.frame_index, keyframe.timestamp, keyframe.features});
      }
      ++counters_.resets;
      Drop(submap->Number());
    }
  }
}

// Places frames in the submap, those closest in time first; each new keyframe helps the next. Two-view
// geometry is the weaker constraint: it is only tried when nothing else makes progress.
bool Mapper::PlaceLeftovers(const Completion& completion, Submap& submap, CompletionAttempts& attempts) {
  active_ = &submap;
  bool any = false;
  bool progress = true;
  while (progress) {
    progress =
        PlaceOnce(submap, completion, false, attempts) || PlaceOnce(submap, completion, true, attempts);
    any = any || progress;
  }
  return any;
}

// Tries each frame once; with `by_two_views`, stops at the first that is placed. Returns true if any was.
bool Mapper::PlaceOnce(Submap& submap, const Completion& completion, bool by_two_views,
                       CompletionAttempts& attempts) {
  const Kind kind = by_two_views ? Kind::kTwoViews : Kind::kLocate;
  bool any = false;
  TrackingViewPtr view = submap.MakeView();
  for (const std::int64_t index : completion.ByDistanceInTime(submap.Map(), leftovers_)) {
    const LeftoverFrame& leftover = leftovers_.ByIndex().at(index);
    const std::optional<TrackedFrame> frame = attempts.Try(kind, submap.Number(), index, [&] {
      return by_two_views ? completion.LocateByTwoViews(submap.Map(), leftover)
                          : completion.Locate(submap.Map(), *view, leftover);
    });
    if (!frame) {
      continue;
    }
    const std::vector<FrameMatch> matches = MatchesOf(*frame, pose_tracker_.Levels());
    if (by_two_views || AddsToMap(submap.Map(), *frame)) {
      OptimizeAround(AddKeyframe(*frame, matches));
      view = submap.MakeView();
      attempts.ForgetFailuresIn(submap.Number());
    } else {  // which leaves the map as it is
      submap.RecordFrame(index, frame->timestamp, frame->anchor, matches);
    }
    leftovers_.Remove(index);
    ++counters_.placed_at_end;
    any = true;
    if (by_two_views) {
      return true;
    }
  }
  return any;
}

// Runs the final bundle adjustment of the active submap.
void Mapper::OptimizeGlobally(bool with_objects, bool with_frames) {
  const MappingOptions& options = options_.mapping;
  if (active_->Map().Keyframes().size() <= 2) {
    return;
  }
  const std::vector<ObjectTerm> terms =
      with_objects ? active_->ObjectTerms(options.joint_objects) : std::vector<ObjectTerm>();
  const BundleAdjustmentReport report =
      GlobalBundleAdjustment(active_->Map(), camera_, kFinalIterations, {terms, options.joint_objects},
                             active_->FramesBetween(with_frames ? options.final_frames : 0));
  active_->CorrectObjects(report.objects, camera_);
}

void Mapper::FinishSubmap(Submap& submap) {
  active_ = &submap;
  OptimizeGlobally(false, true);
  LearnFrom(submap);
  submap.RefineFrames(camera_, options_.tracking.min_inliers);
  KeepUpright(true);
  submap.MapObjectsLast(camera_);
  if (options_.mapping.joint_objects.Final()) {
    OptimizeGlobally(true, true);
  }
}

// The first submap is the one with the most frames: the others use the camera learnt from it.
void Mapper::LearnFrom(Submap& submap) {
  const CameraLearningOptions& options = options_.mapping.camera;
  if (options.what == LearntPart::kNone || learnt_camera_ || submap.Map().Keyframes().size() <= 2) {
    return;
  }
  learnt_camera_ = LearnCamera(submap.Map(), camera_, options);
  camera_ = learnt_camera_->camera;
}

std::vector<FinishedMap> Mapper::Finish(const std::function<bool()>& stop) {
  if (submaps_.empty()) {
    return {};
  }
  const StageTimes::Scope timer(times_, "mapping.final");
  adjustment_.Stop();
  TrackBacklog();
  Complete(stop);
  const std::vector<Submap*> ranked = RankedSubmaps();
  std::vector<FinishedMap> finished;
  for (Submap* submap : ranked) {
    const auto keyframes = static_cast<int>(submap->Map().Keyframes().size());
    if (!finished.empty() && keyframes < kMinSubmapKeyframes) {
      ++counters_.resets;
      Drop(submap->Number());
      continue;
    }
    FinishSubmap(*submap);
    finished.push_back({MakeSnapshot(), submap->FrameTrajectory(), submap->KeyframeTrajectory(),
                        finished.empty() ? learnt_camera_ : std::nullopt,
                        submap->Objects().CountUnrepresentable()});
  }
  active_ = ranked.front();
  outputs_.publish_snapshot(finished.front().snapshot);
  return finished;
}

// Drops a submap that never grew.
void Mapper::Drop(std::int64_t submap) {
  for (const auto& [id, keyframe] : submaps_.at(submap).Map().Keyframes()) {
    places_.Remove(id);
    std::erase_if(loop_edges_, [id = id](const auto& edge) { return edge.first == id || edge.second == id; });
  }
  std::erase_if(atlas_.origins, [submap](const auto& origin) { return origin.second.submap == submap; });
  atlas_.submaps.erase(submap);
  submaps_.erase(submap);
}

}  // namespace sqslam
