#include "slam/mapping/mapper.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <ranges>
#include <set>

#include "slam/estimation/bundle_adjustment.h"
#include "slam/mapping/local_mapping.h"
#include "slam/mapping/track_alignment.h"
#include "slam/objects/detection_filter.h"
#include "slam/util/to_vector.h"

namespace sqslam {

Mapper::Mapper(const Camera& camera, const MapperOptions& options,
               std::shared_ptr<const Vocabulary> vocabulary, Outputs outputs, StageTimes& times,
               std::shared_ptr<IdSource> ids)
    : camera_(camera),
      options_(options),
      ids_(ids ? std::move(ids) : std::make_shared<IdSource>()),
      outputs_(std::move(outputs)),
      times_(times),
      pose_tracker_(camera, options.tracking),
      places_(camera, options.mapping.loops, std::move(vocabulary)),
      adjustment_(options.deterministic || options.in_step),
      leftovers_(options.mapping.completion.max_frames) {}

void Mapper::Process(TrackingReport report) {
  KeepImage(report);
  if (report.objects) {
    CountBoxes(*report.objects);
  }
  const bool begins = report.initial_map != nullptr;
  if (begins) {
    BeginSubmap(report);
  }
  ActivateSubmapOf(report);
  if (active_ == nullptr) {
    return;  // nothing has been mapped yet
  }
  RecordFrame(report);
  if (begins || report.keyframe) {
    MapKeyframe(report, begins);
  }
}

// Keeps a frame for the end of the run. Images placed then keep their keypoints as detected: patches, most of
// the memory of features, can go.
void Mapper::KeepImage(const TrackingReport& report) {
  if (!report.features || (report.pose && !keeps_images_)) {
    return;
  }
  auto features = std::make_shared<FrameFeatures>(*report.features);
  features->patches.reset();
  LeftoverFrame image{report.frame_index, report.timestamp, std::move(features), report.image_path, {}, {}};
  if (report.objects) {
    image.detections = ToVector(report.objects->detections, &SnapshotDetection::detection);
  }
  if (!report.ignored.empty()) {
    constexpr double kScale = 0.25;  // saves memory
    cv::resize(report.ignored, image.ignored, {}, kScale, kScale, cv::INTER_NEAREST);
  }
  if (keeps_images_) {
    images_[report.frame_index] = image;
    keeps_images_ = static_cast<int>(images_.size()) <= options_.mapping.completion.max_frames;
  }
  if (!keeps_images_) {
    images_.clear();
  }
  if (!report.pose) {
    leftovers_.Add(std::move(image));
  }
}

// Maps a new keyframe: local mapping (ORB-SLAM VI), loop closing (VII), then gravity and objects.
void Mapper::MapKeyframe(const TrackingReport& report, bool begins) {
  constexpr int kUnrefinedFrames = 1500;  // the newest, which keep their matches: 20 to 30 MiB
  const StageTimes::Scope timer(times_, "mapping");
  if (!options_.deterministic) {
    step_start_ = std::chrono::steady_clock::now();
  }
  const KeyframeId newest = begins ? active_->Map().NewestKeyframe() : AddKeyframe(report);  // VI-A to C
  PublishView();
  if (begins) {
    outputs_.publish_snapshot(MakeSnapshot());  // two keyframes are better than none if the run ends here
  }
  OptimizeAround(newest, options_.mapping.bundle_adjustment);       // VI-D
  CullKeyframesAround(newest);                                      // VI-E
  const bool adjusted = ApplyAdjusted(adjustment_.TakeFinished());  // CloseLoop() makes it obsolete
  const bool closed = CloseLoop(newest);                            // VII
  KeepUpright(false);
  active_->RefineFrames(camera_, options_.tracking.min_inliers, kUnrefinedFrames);
  MapObjects(adjusted || closed);
  PublishView();
  TrackBacklog();
  outputs_.publish_snapshot(MakeSnapshot());
  step_start_.reset();
  KeepGrownMap();
}

void Mapper::CullKeyframesAround(KeyframeId keyframe) {
  for (const KeyframeId culled :
       CullKeyframes(active_->Map(), keyframe, options_.mapping.culling, loop_edges_)) {
    places_.Remove(culled);
  }
}

void Mapper::MapObjects(bool moved_everywhere) {
  const StageTimes::Scope timer(times_, "mapping.objects");
  active_->MapObjects(camera_, moved_everywhere);
}

// Saves only when the map has grown by a share of its size, so that the cost per keyframe stays constant in
// long runs. The saved bytes grow with the frames too, even if no keyframe is left of them.
void Mapper::KeepGrownMap() {
  constexpr int kMinKeyframes = 10;
  constexpr double kMinGrowth = 0.25;      // of all keyframes, or of as many as take the bytes last kept
  constexpr double kKeyframeBytes = 50e3;  // with a thousand keypoints
  std::size_t keyframes = 0;
  for (const auto& [number, submap] : submaps_) {
    keyframes += submap.Map().Keyframes().size();
  }
  ++keyframes_since_kept_;
  const double size =
      std::max(static_cast<double>(keyframes), static_cast<double>(kept_bytes_) / kKeyframeBytes);
  if (outputs_.keep &&
      keyframes_since_kept_ >= std::max(kMinKeyframes, static_cast<int>(kMinGrowth * size))) {
    const StageTimes::Scope timer(times_, "mapping.keep");
    keyframes_since_kept_ = 0;
    std::string state = Save();
    kept_bytes_ = state.size();
    outputs_.keep(std::move(state));
  }
}

void Mapper::Process(SeenObjects objects) {
  CountBoxes(objects);
  std::vector<Detection> detections = ToVector(objects.detections, &SnapshotDetection::detection);
  if (const auto image = images_.find(objects.frame_index); image != images_.end()) {
    image->second.detections = detections;
  }
  if (LeftoverFrame* leftover = leftovers_.Find(objects.frame_index)) {
    leftover->detections = std::move(detections);
  }
  if (active_ != nullptr) {
    RecordObjects(std::move(objects));
  }
}

void Mapper::BeginSubmap(TrackingReport& report) {
  submaps_.emplace(report.submap, Submap(report.submap, std::move(report.initial_map), options_));
  atlas_.origins[report.submap] = {report.submap, {}};
  Map& map = submaps_.at(report.submap).Map();
  for (const auto& [id, keyframe] : map.Keyframes()) {
    places_.Add(map.At(id));
  }
}

// Activates the submap of the report, which may have been merged into another one meanwhile.
void Mapper::ActivateSubmapOf(const TrackingReport& report) {
  if (const auto origin = atlas_.origins.find(report.submap); origin != atlas_.origins.end()) {
    active_ = &submaps_.at(origin->second.submap);
  }
}

void Mapper::RecordFrame(TrackingReport& report) {
  if (!objects_seen_ && !report.objects) {
    static_cast<FrameStamp&>(shown_) = report;
  }
  tracked_points_ = report.pose ? static_cast<int>(report.matches.size()) : 0;
  tracking_ms_ += report.tracking_ms;
  ++tracking_count_;
  if (report.pose) {
    if (report.matched) {
      const ScaledPose pose = Resolve(*report.pose, active_->Map().PoseOf(report.pose->reference));
      AlignMatches(active_->Map(), camera_, *report.matched, pose.T_camera_map, report.matches);
    }
    active_->RecordFrame(report.frame_index, report.timestamp, *report.pose, report.matches);
    const auto count = [&map = active_->Map()](const std::vector<PointId>& points, int MapPoint::*counter) {
      for (const PointId point : points) {
        if (const PointId present = map.Resolve(point); present != kNoPoint) {
          ++(map.Point(present).*counter);
        }
      }
    };
    count(report.seen.visible, &MapPoint::visible);
    count(report.seen.found, &MapPoint::found);
  }
  if (report.objects) {
    RecordObjects(std::move(*report.objects));
  }
  if (report.backlog) {
    backlog_ = std::move(report.backlog);
  }
}

void Mapper::CountBoxes(const SeenObjects& objects) {
  for (const auto& [detection, id] : objects.detections) {
    ClassAccount& account = seen_boxes_[detection.label];
    ++account.boxes;
    account.ignored += IsUsable(detection, camera_, options_.objects.detections) ? 0 : 1;
  }
}

// The map may have been moved since the frame was tracked.
void Mapper::RecordObjects(SeenObjects objects) {
  if (const auto found = atlas_.origins.find(objects.submap); found != atlas_.origins.end()) {
    const Sim3d S_new_old = found->second.S_map_origin * objects.S_map_origin.Inverse();
    for (ObjectObservation& o : objects.observations) {
      o.T_map_camera = S_new_old * o.T_map_camera;
      if (o.centroid) {
        o.centroid = S_new_old * *o.centroid;
      }
    }
    submaps_.at(found->second.submap).Objects().AddObservations(objects.observations);
  }
  shown_ = std::move(objects);
  objects_seen_ = true;
}

KeyframeId Mapper::AddKeyframe(const TrackingReport& report) {
  const ScaledPose pose = Resolve(*report.pose, active_->Map().PoseOf(report.pose->reference));
  TrackedFrame frame;
  frame.index = report.frame_index;
  frame.timestamp = report.timestamp;
  frame.features = report.keyframe->features;
  frame.points = report.keyframe->points;
  frame.T_camera_map = pose.T_camera_map;
  const KeyframeId id = AddKeyframe(frame, report.matches);
  CountReturn(id);
  return id;
}

// `completion`: at the end of a run, new points come from its matches, which are few but hardly ever wrong;
// null: from a search along epipolar lines, whose mistakes the next frames of a film uncover.
KeyframeId Mapper::AddKeyframe(const TrackedFrame& frame, std::vector<FrameMatch> matches,
                               const Completion* completion) {
  Map& map = active_->Map();
  const KeyframeId id = map.AddKeyframe(frame.index, frame.timestamp, frame.T_camera_map, frame.features);
  std::set<PointId> used;
  for (std::size_t i = 0; i < frame.points.size(); ++i) {
    const PointId point = map.Resolve(frame.points[i]);
    if (point != kNoPoint && used.insert(point).second) {
      map.AddObservation(point, id, static_cast<int>(i));
      map.UpdateAppearance(point);
    }
  }
  map.UpdateCovisibility(id);
  places_.Add(map.At(id));
  active_->RecordFrame(frame.index, frame.timestamp, {id, {}, map.At(id).scale}, std::move(matches));
  const StageTimes::Scope timer(times_, "mapping.new_points");
  if (completion != nullptr) {
    completion->AddNewPoints(map, id);
    return id;
  }
  CullPoints(map, active_->YoungPoints(), id);                          // ORB-SLAM VI-B
  const std::vector<PointId> created = AddNewPoints(map, camera_, id);  // VI-C
  active_->YoungPoints().insert(created.begin(), created.end());
  AlignObservations(map, camera_, id);
  return id;
}

// Counts a return to a known place: the keyframe is covisible with an old one, but not with those between.
void Mapper::CountReturn(KeyframeId id) {
  constexpr int kMinBetween = 3;  // keyframes
  const Map& map = active_->Map();
  const auto& covisible = map.At(id).covisibility;
  int between = 0;
  for (const auto& [other, keyframe] : map.Keyframes()) {
    between +=
        !covisible.empty() && other > covisible.begin()->first && other < id && !covisible.contains(other);
  }
  counters_.returns += between >= kMinBetween && !returned_ ? 1 : 0;
  returned_ = between >= kMinBetween;
}

void Mapper::OptimizeAround(KeyframeId keyframe, const BundleAdjustmentOptions& options) {
  OptimizeWindow(LocalWindow(active_->Map(), keyframe, options.max_keyframes), options);
}

void Mapper::OptimizeWindow(const std::vector<KeyframeId>& window, const BundleAdjustmentOptions& options) {
  const StageTimes::Scope timer(times_, "mapping.bundle_adjustment");
  if (active_->Map().Keyframes().size() > 2) {
    const JointObjectOptions& joint = options_.mapping.joint_objects;
    const std::vector<ObjectTerm> terms =
        joint.Local() ? active_->ObjectTerms(joint) : std::vector<ObjectTerm>();
    const BundleAdjustmentReport report = LocalBundleAdjustment(active_->Map(), camera_, window, options,
                                                                outputs_.keyframe_waiting, {terms, joint});
    active_->CorrectObjects(report.objects, camera_);
  }
}

void Mapper::KeepUpright(bool last) {
  if (const std::optional<Rigid3d> T_new_old = active_->KeepUpright(camera_, last)) {
    MoveOrigins(active_->Number(), Sim3d::FromRigid(*T_new_old), active_->Number());
  }
}

std::vector<const Map*> Mapper::MapsActiveFirst() const {
  std::vector<const Map*> maps{&active_->Map()};
  for (const auto& [number, submap] : submaps_) {
    if (&submap != active_) {
      maps.push_back(&submap.Map());
    }
  }
  return maps;
}

Submap& Mapper::SubmapWith(KeyframeId keyframe) {
  return std::ranges::find_if(submaps_,
                              [&](const auto& entry) { return entry.second.Map().HasKeyframe(keyframe); })
      ->second;
}

// Closes a loop or merges two submaps if the keyframe shows a place that is already mapped. Returns true if
// it did.
bool Mapper::CloseLoop(KeyframeId keyframe) {
  constexpr KeyframeId kMinInterval = 10;  // keyframes from a loop closure to the next search
  if (!options_.mapping.loops.close || (last_loop_ != kNoKeyframe && keyframe - last_loop_ < kMinInterval)) {
    return false;
  }
  const StageTimes::Scope timer(times_, "mapping.loops");
  const std::optional<LoopCandidate> loop = places_.Recognize(MapsActiveFirst(), keyframe);
  if (!loop) {
    return false;
  }
  adjustment_.Stop();
  last_loop_ = keyframe;
  Submap& known = SubmapWith(loop->known);
  if (&known == active_) {
    active_->Deform([&](Map& map) { CorrectLoop(map, camera_, *loop, loop_edges_); });
    ++counters_.loops;
  } else {
    MergeSubmaps(*loop, known);
    ++counters_.merges;
  }
  AdjustInBackground(options_.mapping.loops.bundle_iterations);
  return true;
}

// Merges the younger submap into the older one.
void Mapper::MergeSubmaps(const LoopCandidate& loop, Submap& known) {
  const Sim3d S_known_active = SimilarityOfMaps(active_->Map(), known.Map(), loop);
  const bool keep_known = known.Number() < active_->Number();
  Submap& kept = keep_known ? known : *active_;
  Submap& dropped = keep_known ? *active_ : known;
  const Sim3d S_kept_dropped = keep_known ? S_known_active : S_known_active.Inverse();
  const std::int64_t number = dropped.Number();
  // Chosen before the maps are one: afterwards, the neighbours of either side would be mostly those of one
  // map.
  const int size = options_.mapping.bundle_adjustment.max_keyframes;
  std::vector<KeyframeId> window = LocalWindow(active_->Map(), loop.current, size);
  std::ranges::copy(LocalWindow(known.Map(), loop.known, size), std::back_inserter(window));
  dropped.Deform([&](Map& map) { map.Transform(S_kept_dropped); });
  kept.Absorb(std::move(dropped));
  kept.Map().Reroot(keep_known ? loop.current : loop.known, keep_known ? loop.known : loop.current);
  MoveOrigins(number, S_kept_dropped, kept.Number());
  submaps_.erase(number);
  atlas_.submaps.erase(number);
  active_ = &kept;
  loop_edges_.insert(std::minmax(loop.current, loop.known));
  FuseLoop(active_->Map(), camera_, loop);
  OptimizeWindow(window, options_.mapping.bundle_adjustment);
}

// Merges at the keyframe that confirms most points of another submap.
bool Mapper::TieToOthers(std::int64_t submap) {
  active_ = &submaps_.at(submap);
  const std::vector<const Map*> maps = MapsActiveFirst();
  std::vector<KeyframeId> own;
  std::optional<LoopCandidate> best;
  for (const auto& [id, keyframe] : active_->Map().Keyframes()) {
    own.push_back(id);
    std::optional<LoopCandidate> loop = places_.Recognize(maps, id);
    if (loop && !active_->Map().HasKeyframe(loop->known) &&
        (!best || loop->confirmed.size() > best->confirmed.size())) {
      best = std::move(loop);
    }
  }
  if (!best) {
    return false;
  }
  MergeSubmaps(*best, SubmapWith(best->known));
  ++counters_.merges;
  // The two sides overlap in more than one place: the first pass fuses where they already align, and the
  // second, after an adjustment, the rest.
  for (int pass = 0; pass < 2; ++pass) {
    for (const KeyframeId id : own) {
      if (const auto loop = places_.Recognize({&active_->Map()}, id)) {
        FuseLoop(active_->Map(), camera_, *loop);
        loop_edges_.insert(std::minmax(loop->current, loop->known));
      }
    }
    active_->Deform([this](Map&) { OptimizeGlobally(false); });
  }
  PublishView();
  return true;
}

// Adjusts a copy of the whole map while mapping continues.
void Mapper::AdjustInBackground(int iterations) {
  if (iterations > 0) {
    adjustment_.Start({active_->Number(), atlas_.origins.at(active_->Number()).S_map_origin,
                       ExtractBundleProblem(active_->Map(), camera_)},
                      {iterations, iterations});
  }
}

// Takes over the result of a background bundle adjustment, if any. Returns true if the active map changed.
bool Mapper::ApplyAdjusted(std::optional<BackgroundAdjustment::Job> job) {
  if (!job) {
    return false;
  }
  const StageTimes::Scope timer(times_, "mapping.take_adjustment");
  const Sim3d S_now_then = atlas_.origins.at(job->submap).S_map_origin * job->S_map_origin.Inverse();
  Submap& submap = submaps_.at(job->submap);
  submap.Deform([&](Map& map) { ApplyAdjustment(std::move(job->problem), S_now_then, map); });
  atlas_.submaps[job->submap] = submap.MakeView();
  return job->submap == active_->Number();
}

// Records that the content of `submap` was moved by S_new_old and now belongs to `new_submap`.
void Mapper::MoveOrigins(std::int64_t submap, const Sim3d& S_new_old, std::int64_t new_submap) {
  for (auto& [number, origin] : atlas_.origins) {
    if (origin.submap == submap) {
      origin = {new_submap, S_new_old * origin.S_map_origin};
    }
  }
}

bool Mapper::HasFrame(std::int64_t index) const {
  return std::ranges::any_of(std::views::values(submaps_),
                             [&](const Submap& submap) { return submap.Frames().contains(index); });
}

std::optional<std::pair<std::int64_t, double>> Mapper::NewestFrame() const {
  std::optional<std::pair<std::int64_t, double>> newest;
  for (const auto& [number, submap] : submaps_) {
    const auto& [index, record] = *submap.Frames().rbegin();
    newest = {std::max(newest ? newest->first : 0, index),
              std::max(newest ? newest->second : 0.0, record.timestamp)};
  }
  return newest;
}

// Tracks the frames before the map's first keyframe once the map is large enough to locate them.
void Mapper::TrackBacklog() {
  constexpr std::size_t kMinKeyframes = 4;
  if (!backlog_ || active_->Map().Keyframes().size() < kMinKeyframes) {
    return;
  }
  const StageTimes::Scope timer(times_, "mapping.backlog");
  const TrackingViewPtr view = active_->MakeView();
  if (view->Knows(backlog_->next.anchor.reference)) {
    for (const TrackedFrame& frame : TrackBackward(pose_tracker_, *view, *backlog_)) {
      if (!HasFrame(frame.index)) {
        std::vector<FrameMatch> matches = MatchesOf(frame, pose_tracker_.Levels());
        AlignMatches(active_->Map(), camera_, *frame.features, frame.T_camera_map, matches);
        active_->RecordFrame(frame.index, frame.timestamp, frame.anchor, std::move(matches));
      }
    }
  }
  backlog_.reset();
}

void Mapper::PublishView() {
  const StageTimes::Scope timer(times_, "mapping.view");
  atlas_.submaps[active_->Number()] = active_->MakeView();
  outputs_.publish_atlas(std::make_shared<const AtlasView>(atlas_));
}

SnapshotProgress Mapper::TakeProgress() {
  using Milliseconds = std::chrono::duration<double, std::milli>;
  const double mapping_ms =
      step_start_ ? Milliseconds(std::chrono::steady_clock::now() - *step_start_).count() : 0.0;
  const double tracking_ms =
      std::exchange(tracking_ms_, 0.0) / std::max(std::exchange(tracking_count_, 0), 1);
  return {.tracked_points = tracked_points_,
          .tracking_ms = tracking_ms,
          .mapping_ms = mapping_ms,
          .counters = counters_};
}

MapSnapshotPtr Mapper::MakeSnapshot() {
  const StageTimes::Scope timer(times_, "mapping.snapshot");
  auto snapshot = std::make_shared<MapSnapshot>();
  snapshot->sequence_number = snapshots_++;
  snapshot->frame_index = shown_.frame_index;
  snapshot->timestamp = shown_.timestamp;
  snapshot->image_path = shown_.image_path;
  snapshot->camera = camera_;
  snapshot->T_map_camera = active_->FramePose(shown_.frame_index);
  snapshot->detections = shown_.detections;
  snapshot->progress = TakeProgress();
  active_->FillSnapshot(*snapshot);
  return snapshot;
}

}  // namespace sqslam
