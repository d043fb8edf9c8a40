// Completion of the map at the end of a run: leftover frames start, join or find a place in submaps.
#include <algorithm>
#include <ranges>

#include "slam/estimation/reprojection_error.h"
#include "slam/mapping/local_mapping.h"
#include "slam/mapping/mapper.h"
#include "slam/tracking/initializer.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

using Kind = CompletionAttempts::Kind;

// Returns true if the frame shows enough that its reference keyframe does not.
bool AddsToMap(const Map& map, const TrackedFrame& frame) {
  constexpr double kMaxTrackedShare = 0.8;  // of the points of the reference
  auto points = map.At(frame.anchor.reference).SeenPoints();
  const auto seen = static_cast<double>(std::distance(points.begin(), points.end()));
  return frame.inliers < kMaxTrackedShare * seen;
}

}  // namespace

ViewGraph Mapper::MakeViewGraph() const {
  ViewGraph views(camera_, places_, options_.database);
  for (const auto& [number, submap] : submaps_) {
    for (const auto& [id, keyframe] : submap.Map().Keyframes()) {
      views.Add(keyframe.frame_index, keyframe.features, number);
    }
  }
  for (const auto& [index, frame] : leftovers_.ByIndex()) {
    views.Add(index, frame.features);
  }
  return views;
}

void Mapper::Complete(const std::function<bool()>& stop) {
  for (const std::int64_t index : leftovers_.Indices()) {
    if (HasFrame(index)) {
      leftovers_.Remove(index);
    }
  }
  DissolveSmallSubmaps();
  if (options_.mapping.completion.max_frames == 0 || (leftovers_.ByIndex().empty() && submaps_.size() <= 1)) {
    return;
  }
  const StageTimes::Scope timer(times_, "mapping.completion");
  ViewGraph views = MakeViewGraph();
  views.Match(stop);
  Completion completion(camera_, pose_tracker_, views);
  CompletionAttempts attempts(stop);
  do {
    bool progress = true;
    while (progress) {
      progress = TieLeftoverSubmaps(completion, attempts);
      for (Submap* submap : RankedSubmaps()) {
        progress = PlaceLeftovers(completion, *submap, attempts) || progress;
      }
    }
  } while (!attempts.Stopped() && StartSubmap(completion));
}

// Starts a submap from the two leftovers whose map further frames confirm best. Returns true if it did.
bool Mapper::StartSubmap(Completion& completion) {
  const auto view_of = [this](std::int64_t index) {
    const LeftoverFrame& frame = leftovers_.ByIndex().at(index);
    return StartView{frame.index, frame.timestamp, frame.features};
  };
  // Two images alone cannot be confirmed.
  const double min_support = leftovers_.ByIndex().size() > 2 ? 0.3 : 0.0;
  std::unique_ptr<Map> best;
  double best_support = 0.0;
  for (const StartPair& pair : completion.Starts(leftovers_)) {
    std::unique_ptr<Map> map =
        MapOfTwoViews(camera_, std::make_unique<Map>(pose_tracker_.Levels(), ids_), view_of(pair.first),
                      view_of(pair.second), pair.geometry, pair.matches,
                      options_.tracking.initialization.two_view.min_points);
    const double support = map ? completion.ThirdViewSupport(*map, leftovers_) : 0.0;
    if (map && support >= min_support && (!best || support > best_support)) {
      best_support = support;
      best = std::move(map);
    }
  }
  if (!best) {
    return false;
  }
  TrackingReport report;
  report.submap = atlas_.origins.empty() ? 1 : atlas_.origins.rbegin()->first + 1;
  for (const auto& [id, keyframe] : best->Keyframes()) {
    placed_[keyframe.frame_index] = leftovers_.ByIndex().at(keyframe.frame_index);
    leftovers_.Remove(keyframe.frame_index);
  }
  report.initial_map = std::move(best);
  BeginSubmap(report);
  return true;
}

// Merges submaps, the largest first, until no two of them share a view.
bool Mapper::TieLeftoverSubmaps(const Completion& completion, CompletionAttempts& attempts) {
  bool any = false;
  bool tied = true;
  while (tied && submaps_.size() > 1) {
    tied = false;
    const std::vector<Submap*> ranked = RankedSubmaps();
    for (std::size_t i = 0; i < ranked.size() && !tied; ++i) {
      const TrackingViewPtr view = ranked[i]->MakeView();
      for (std::size_t j = i + 1; j < ranked.size() && !tied; ++j) {
        const std::vector<CommonView> common = completion.CommonViews(ranked[j]->Map(), ranked[i]->Map());
        int evidence = 0;
        for (const CommonView& pair : common) {
          evidence += pair.matches;
        }
        const auto tie =
            evidence == 0 ? std::nullopt
                          : attempts.Try(Kind::kTie, ranked[i]->Number(), ranked[j]->Number(), evidence, [&] {
                              return completion.Tie(ranked[j]->Map(), ranked[i]->Map(), *view, common);
                            });
        if (!tie) {
          continue;
        }
        active_ = ranked[j];
        MergeSubmaps(tie->loop, *ranked[i]);
        active_->Deform([this](sqslam::Map&) { OptimizeGlobally(false); });
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
        const auto image = images_.find(keyframe.frame_index);
        leftovers_.Add(image != images_.end()
                           ? image->second
                           : LeftoverFrame{keyframe.frame_index, keyframe.timestamp, keyframe.features});
      }
      ++counters_.resets;
      Drop(submap->Number());
    }
  }
}

// Places frames in the submap, each new keyframe helps the next. Whenever it has grown, adjusts all of it
// while further frames are placed; the result is taken after a fixed number of them, so that runs can be
// repeated. The strongest evidence comes first: a frame in a wrong place draws its neighbours there. Points
// in a thirtieth of an image placed one 50 degrees off that two-view geometry with its neighbour places
// rightly.
bool Mapper::PlaceLeftovers(const Completion& completion, Submap& submap, CompletionAttempts& attempts) {
  constexpr double kGrowth = 1.1;  // of the number of keyframes, until an adjustment begins or ends
  active_ = &submap;
  bool any = false;
  bool progress = true;
  auto keyframes = static_cast<double>(submap.Map().Keyframes().size());
  while (progress) {
    progress = PlaceOnce(submap, completion, Kind::kLocate, attempts) ||
               PlaceOnce(submap, completion, Kind::kTwoViews, attempts) ||
               PlaceOnce(submap, completion, Kind::kLocateLoosely, attempts);
    any = any || progress;
    const auto now = static_cast<double>(submap.Map().Keyframes().size());
    if (now > kGrowth * keyframes) {
      keyframes = now;
      if (!ApplyAdjusted(adjustment_.Wait())) {
        AdjustInBackground(kFinalIterations);
      }
    }
  }
  if (leftovers_.ByIndex().empty()) {
    adjustment_.Stop();  // all is adjusted again when the map is finished
  }
  ApplyAdjusted(adjustment_.Wait());
  return any;
}

// Places the frame that shares most points with the submap; if it can't be placed, the next. Returns true if
// any was.
bool Mapper::PlaceOnce(Submap& submap, const Completion& completion, Kind kind,
                       CompletionAttempts& attempts) {
  constexpr std::size_t kMinShared = 8;
  // Roughly, as all keyframes are adjusted whenever the map has grown.
  BundleAdjustmentOptions rough = options_.mapping.bundle_adjustment;
  rough.max_keyframes = 8;
  rough.cost_tolerance = 1e-3;
  std::vector<std::pair<std::int64_t, SharedPoints>> ranked;
  for (const std::int64_t index : leftovers_.Indices()) {
    SharedPoints shared = completion.PointsShared(submap.Map(), index);
    if (shared.matches.size() >= kMinShared) {
      ranked.emplace_back(index, std::move(shared));
    }
  }
  std::ranges::stable_sort(ranked, std::greater<>(),
                           [](const auto& entry) { return entry.second.matches.size(); });
  const TrackingViewPtr view = ranked.empty() ? nullptr : submap.MakeView();
  for (const auto& [index, shared] : ranked) {
    const LeftoverFrame leftover = leftovers_.ByIndex().at(index);
    const std::optional<TrackedFrame> frame = attempts.Try(
        kind, submap.Number(), index, static_cast<int>(shared.matches.size()), [&, &common = shared] {
          return kind == Kind::kTwoViews ? completion.LocateByTwoViews(submap.Map(), leftover)
                 : kind == Kind::kLocate ? completion.Locate(*view, common, leftover, kMaxCornerDeviation)
                                         : completion.Locate(*view, common, leftover);
        });
    if (!frame) {
      continue;
    }
    const std::vector<FrameMatch> matches = MatchesOf(*frame, pose_tracker_.Levels());
    const bool adds = kind == Kind::kTwoViews || AddsToMap(submap.Map(), *frame);
    if (adds) {
      const KeyframeId id = AddKeyframe(*frame, matches, &completion);
      OptimizeAround(id, rough);
      CloseLoopByViews(completion, id);
    } else {  // which leaves the map as it is
      submap.RecordFrame(index, frame->timestamp, frame->anchor, matches);
    }
    leftovers_.Remove(index);
    placed_[index] = leftover;
    if (adds) {
      return true;
    }
  }
  return false;
}

// Closes a loop of the active submap between keyframes that show the same things with different map points.
bool Mapper::CloseLoopByViews(const Completion& completion, KeyframeId keyframe) {
  constexpr KeyframeId kMinInterval = 10;  // keyframes
  constexpr int kMaxAttempts = 3;
  if (!options_.mapping.loops.close || (last_loop_ != kNoKeyframe && keyframe - last_loop_ < kMinInterval)) {
    return false;
  }
  for (const KeyframeId known :
       completion.LoopsAt(active_->Map(), keyframe) | std::views::take(kMaxAttempts)) {
    const std::optional<LoopCandidate> loop = places_.Verify(active_->Map(), keyframe, known);
    if (loop) {
      adjustment_.Stop();
      last_loop_ = keyframe;
      active_->Deform([&](Map& map) { CorrectLoop(map, camera_, *loop, loop_edges_); });
      active_->Deform([this](Map&) { OptimizeGlobally(false); });
      ++counters_.loops;
      return true;
    }
  }
  return false;
}

}  // namespace sqslam
