// The end of a run: leftovers are tried once more, then every submap gets its last adjustment.
#include <algorithm>
#include <ranges>

#include "slam/features/sift_extractor.h"
#include "slam/mapping/local_mapping.h"
#include "slam/mapping/mapper.h"
#include "slam/tracking/initializer.h"
#include "slam/util/parallel.h"
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

ViewGraph Mapper::MakeViewGraph() const {
  ViewGraph views(camera_, places_);
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

// Places frames in the submap, each new keyframe helps the next; adjusts all of it whenever it has grown.
// The strongest evidence comes first: a frame in a wrong place draws its neighbours there. Points in a small
// part of the image placed one 50 degrees off (hololens), two-view geometry with its neighbour places it
// rightly.
bool Mapper::PlaceLeftovers(const Completion& completion, Submap& submap, CompletionAttempts& attempts) {
  constexpr double kGrowth = 1.2;  // of the number of keyframes, until all are adjusted
  active_ = &submap;
  bool any = false;
  bool progress = true;
  std::size_t adjusted = submap.Map().Keyframes().size();
  while (progress) {
    progress = PlaceOnce(submap, completion, Kind::kLocate, attempts) ||
               PlaceOnce(submap, completion, Kind::kTwoViews, attempts) ||
               PlaceOnce(submap, completion, Kind::kLocateLoosely, attempts);
    any = any || progress;
    if (static_cast<double>(submap.Map().Keyframes().size()) > kGrowth * static_cast<double>(adjusted)) {
      submap.Deform([this](Map&) { OptimizeGlobally(false); });
      adjusted = submap.Map().Keyframes().size();
    }
  }
  return any;
}

// Places the frame that shares most points with the submap; if it can't be placed, the next. Returns true if
// any was.
bool Mapper::PlaceOnce(Submap& submap, const Completion& completion, Kind kind,
                       CompletionAttempts& attempts) {
  constexpr std::size_t kMinShared = 8;
  constexpr double kMaxDeviation = 2.0;  // px in the corners of the image, for one pixel of noise
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
                 : kind == Kind::kLocate ? completion.Locate(*view, common, leftover, kMaxDeviation)
                                         : completion.Locate(*view, common, leftover);
        });
    if (!frame) {
      continue;
    }
    const std::vector<FrameMatch> matches = MatchesOf(*frame, pose_tracker_.Levels());
    const bool adds = kind == Kind::kTwoViews || AddsToMap(submap.Map(), *frame);
    if (adds) {
      const KeyframeId id = AddKeyframe(*frame, matches, &completion);
      OptimizeAround(id);
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
      last_loop_ = keyframe;
      active_->Deform([&](Map& map) { CorrectLoop(map, camera_, *loop, loop_edges_); });
      active_->Deform([this](Map&) { OptimizeGlobally(false); });
      ++counters_.loops;
      return true;
    }
  }
  return false;
}

std::size_t Mapper::FramesInMain() const {
  std::size_t most = 0;
  for (const auto& [number, submap] : submaps_) {
    most = std::max(most, submap.Frames().size());
  }
  return most;
}

// Returns true if the main map holds nearly all images, or if there were too many to map them in another way.
bool Mapper::HasMappedImages() const {
  constexpr double kMinMapped = 0.95;
  return !keeps_images_ ||
         static_cast<double>(FramesInMain()) >= kMinMapped * static_cast<double>(images_.size());
}

// Returns the images that can be read again, with features for views that are far apart.
std::vector<LeftoverFrame> Mapper::ImagesWithSift(const std::function<bool()>& stop) const {
  constexpr std::size_t kPart = 8;  // images between two calls of `stop`, which belongs to this thread
  std::vector<LeftoverFrame> images;
  if (outputs_.read_image) {
    images = ToVector(images_ | std::views::values);
  }
  std::erase_if(images, [](const LeftoverFrame& image) { return image.image_path.empty(); });
  const SiftExtractor extractor({});
  for (std::size_t begin = 0; begin < images.size() && !(stop && stop()); begin += kPart) {
    ParallelFor(std::min(kPart, images.size() - begin), 0, [&](std::size_t k) {
      LeftoverFrame& image = images[begin + k];
      const cv::Mat bgr = outputs_.read_image(image.image_path, true);
      image.features = std::make_shared<const FrameFeatures>(
          bgr.empty() ? FrameFeatures()
                      : extractor.Extract(bgr, camera_, pose_tracker_.Levels(), image.ignored));
    });
  }
  return images;
}

// Maps images as photographs, in any order. Keeps that map and returns true if it holds more of them.
bool Mapper::MapAfresh(std::vector<LeftoverFrame> images, const std::function<bool()>& stop) {
  Mapper afresh(camera_, options_, nullptr, {{}, {}, [] { return false; }}, times_, ids_);
  afresh.places_ = places_;
  for (const auto& [number, submap] : submaps_) {
    for (const auto& [id, keyframe] : submap.Map().Keyframes()) {
      afresh.places_.Remove(id);
    }
  }
  for (LeftoverFrame& image : images) {
    afresh.leftovers_.Add(std::move(image));
  }
  afresh.Complete(stop);
  if (afresh.FramesInMain() <= FramesInMain()) {
    return false;
  }
  counters_ = counters_ + afresh.counters_;
  submaps_ = std::move(afresh.submaps_);
  atlas_ = std::move(afresh.atlas_);
  places_ = std::move(afresh.places_);
  loop_edges_ = std::move(afresh.loop_edges_);
  leftovers_ = std::move(afresh.leftovers_);
  placed_ = std::move(afresh.placed_);
  active_ = RankedSubmaps().front();
  for (SnapshotDetection& detection : shown_.detections) {
    detection.object_id = -1;  // of the other map
  }
  return true;
}

// Tracks the boxes of the frames that were placed at the end, in the order of time.
void Mapper::TrackPlacedBoxes() {
  int next_id = 0;
  for (const auto& [number, submap] : submaps_) {
    next_id = std::max(next_id, submap.Objects().View()->IdBound());
  }
  for (Submap* submap : RankedSubmaps()) {
    ObjectTracker tracker(options_.objects);
    tracker.StartIdsAt(next_id);
    for (const auto& [index, frame] : placed_) {
      if (submap->Frames().contains(index) && !frame.detections.empty()) {
        TrackBoxesOf(frame, *submap, tracker);
      }
    }
    next_id = std::max(next_id, tracker.NextId());
  }
}

void Mapper::TrackBoxesOf(const LeftoverFrame& image, Submap& submap, ObjectTracker& tracker) {
  ObjectFrame frame;
  frame.frame_index = image.index;
  frame.T_map_camera = *submap.FramePose(image.index);
  frame.camera = camera_;
  frame.detections = image.detections;
  if (outputs_.read_image) {
    frame.gray = outputs_.read_image(image.image_path, false);
  }
  frame.points = submap.PointsIn(image.index, camera_);
  const std::vector<ObjectObservation> observations = tracker.Track(frame, *submap.Objects().View(), &times_);
  submap.Objects().AddObservations(observations);
  if (image.index == shown_.frame_index) {
    shown_.detections = ToVector(image.detections, [](const Detection& detection) {
      return SnapshotDetection{detection, -1};  // boxes seen before any map began were not recorded
    });
    for (const ObjectObservation& o : observations) {
      shown_.detections[o.detection_index].object_id = o.object_id;
    }
  }
  if (const std::optional<Rigid3d> T_new_old = submap.KeepUpright(camera_, false)) {
    const Sim3d S_new_old = Sim3d::FromRigid(*T_new_old);
    MoveOrigins(submap.Number(), S_new_old, submap.Number());
    tracker.Transform(S_new_old);
  }
  submap.MapObjects(camera_, false);
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
  const StageTimes::Scope timer(times_, "mapping.final");
  adjustment_.Stop();
  if (active_ != nullptr) {
    TrackBacklog();
  }
  // SIFT takes thirty times as long as the features of tracking, so those get a chance first.
  bool afresh = !HasMappedImages() && MapAfresh(ToVector(images_ | std::views::values), stop);
  if (!HasMappedImages() && !(stop && stop())) {
    afresh = MapAfresh(ImagesWithSift(stop), stop) || afresh;
  }
  if (!afresh) {
    Complete(stop);
  }
  if (submaps_.empty()) {
    return {};
  }
  counters_.placed_at_end += static_cast<int>(placed_.size());
  TrackPlacedBoxes();
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
                        finished.empty() ? learnt_camera_ : std::nullopt, submap->Objects().Account()});
  }
  Add(seen_boxes_, finished.front().account);
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
