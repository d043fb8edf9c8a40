#include "slam/tracking/tracker.h"

#include <algorithm>

namespace sqslam {
namespace {

constexpr double kMaxInterval = 0.5;  // s, longest time between frames over which motion is extrapolated
constexpr double kMinSharedView =
    0.5;  // of the reference's points, tracked in images that are near each other

// Photographs share less of their view than frames of a film: more features make up for it.
OrbOptions RichFeatures(OrbOptions options) {
  constexpr double kTimes = 5.0;
  options.num_features = static_cast<int>(kTimes * options.num_features);
  return options;
}

}  // namespace

Tracker::Tracker(const Camera& camera, const TrackingOptions& options, const ObjectOptions& objects,
                 std::shared_ptr<IdSource> ids, std::shared_ptr<const Vocabulary> vocabulary,
                 StageTimes& times)
    : camera_(camera),
      options_(options),
      features_(camera, options.features, options.moving, times),
      rich_extractor_(RichFeatures(options.features)),
      pose_tracker_(camera, options),
      shutter_(camera, options.rolling_shutter),
      initializer_(camera, options.initialization, pose_tracker_.Levels(), std::move(ids)),
      relocalizer_(std::move(vocabulary)),
      object_options_(objects),
      times_(times) {}

void Tracker::BeginIn(const AtlasViewPtr& atlas, std::int64_t submap) {
  int next_object = 0;
  for (const auto& [number, view] : atlas->submaps) {
    next_object = std::max(next_object, view->objects->IdBound());
  }
  atlas_ = atlas;
  submaps_begun_ = atlas->origins.rbegin()->first + 1;
  lost_frames_ = 1;
  const TrackingView& view = *atlas->submaps.at(submap);
  features_.SetKind(view.keyframes.begin()->second.features->kind);
  SwitchSubmap(submap, atlas->submaps.at(submap), atlas->origins.at(submap).S_map_origin);
  Objects().StartIdsAt(next_object);
}

TrackingReport Tracker::Track(const Frame& frame, const AtlasViewPtr& atlas, int pending_keyframes) {
  const StageTimes::Scope timer(times_, "tracking");
  TrackingReport report;
  const ExtractedFeatures extracted = features_.Take(frame);
  report.ignored = extracted.ignored;
  BeginFrame(frame, extracted.features);
  AdoptAtlas(atlas);
  const bool tracked = view_ && (Lost() ? Relocalize(frame, report) : EstimatePose(report));
  if (tracked) {
    ReportPose(pending_keyframes, report);
  } else {
    BeginSubmapOrWait(report);
  }
  TrackObjects(frame, tracked, report);
  report.matched = current_.features;
  report.features = FeaturesToKeep(frame, extracted.ignored, tracked);
  static_cast<FrameStamp&>(report) = StampOf(frame);
  return report;
}

void Tracker::BeginFrame(const Frame& frame, const FrameFeaturesPtr& features) {
  current_ = {};
  current_.index = frame.index;
  current_.timestamp = frame.timestamp;
  current_.features = features;
  current_.ClearPoints();
  motion_.reset();
}

// Returns what the mapping thread keeps of a frame for the end of the run: more features if it shares little
// with the frames before.
FrameFeaturesPtr Tracker::FeaturesToKeep(const Frame& frame, const cv::Mat& ignored, bool tracked) {
  constexpr int kMaxRichFrames = 60;
  if (features_.Kind() != FeatureKind::kOrb || (tracked && TrackedShare() >= kMinSharedView) ||
      rich_frames_ == kMaxRichFrames) {
    return current_.features;
  }
  ++rich_frames_;
  return std::make_shared<const FrameFeatures>(
      rich_extractor_.Extract(frame.gray, frame.bgr, camera_, ignored));
}

FrameView Tracker::Newest() const {
  FrameView view;
  view.frame_index = current_.index;
  if (view_ && !Lost()) {
    view.T_map_camera = current_.T_camera_map.Inverse();
  }
  const std::size_t count = current_.features ? current_.features->Size() : 0;
  view.features.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    view.features.push_back(
        {current_.features->keypoints[i].raw_pixel.cast<float>(), current_.points[i] != kNoPoint});
  }
  return view;
}

// Adopts the newest view of the submap, follows it if it was merged into another one, and moves the last pose
// with its reference keyframe.
void Tracker::AdoptAtlas(const AtlasViewPtr& atlas) {
  if (!atlas || atlas == atlas_) {
    return;
  }
  atlas_ = atlas;
  const auto origin = atlas->origins.find(submap_);
  if (origin == atlas->origins.end()) {
    return;  // the mapping thread has not processed the start of the submap yet
  }
  const auto& [submap, S_map_origin] = origin->second;
  const TrackingViewPtr& view = atlas->submaps.at(submap);
  if (view == view_) {
    return;
  }
  const Sim3d S_new_old = S_map_origin * S_map_origin_.Inverse();
  if (submap != submap_) {
    SwitchSubmap(submap, view, atlas->origins.at(submap).S_map_origin);
  } else {
    if (S_new_old.scale != 1.0 || !S_new_old.rotation.isApprox(Eigen::Quaterniond::Identity(), 1e-12)) {
      Objects().Transform(S_new_old);
    }
    view_ = view;
    S_map_origin_ = S_map_origin;
  }
  MoveLastFrame();
}

void Tracker::MoveLastFrame() {
  if (!last_) {
    return;
  }
  const ScaledPose reference = view_->PoseOf(last_->anchor.reference);
  const double growth = reference.scale / last_->anchor.scale;
  last_->T_camera_map = Resolve(last_->anchor, reference).T_camera_map;
  last_->anchor = {last_->anchor.reference, last_->T_camera_map * reference.T_camera_map.Inverse(),
                   reference.scale};
  if (velocity_) {
    velocity_->T_current_last.translation *= growth;
  }
  for (PointId& point : last_->points) {
    point = view_->Resolve(point);
  }
}

void Tracker::SwitchSubmap(std::int64_t submap, const TrackingViewPtr& view, const Sim3d& S_map_origin) {
  int next_id = 0;
  for (const auto& [number, objects] : object_trackers_) {
    next_id = std::max(next_id, objects.NextId());
  }
  const auto [objects, is_new] = object_trackers_.try_emplace(submap, object_options_);
  objects->second.StartIdsAt(next_id);
  submap_ = submap;
  view_ = view;
  S_map_origin_ = S_map_origin;
}

// Estimates the pose from the last frame's motion, or else from its reference keyframe, then from the local
// map; if these fail, without a prediction.
bool Tracker::EstimatePose(TrackingReport& report) {
  const StageTimes::Scope timer(times_, "tracking.pose");
  bool tracked = last_ && (pose_tracker_.TrackMotion(*view_, *last_, PredictedMotion(), current_) ||
                           pose_tracker_.TrackReferenceKeyframe(*view_, *last_, current_));
  if (tracked) {
    if (const auto motion = Motion(); motion && shutter_.Readout() != 0.0) {
      current_.features = shutter_.Correct(current_.features, *motion, ShutterObservations());
    }
    tracked =
        pose_tracker_.TrackLocalMap(*view_, {.min_inliers = options_.min_inliers}, current_, report.seen) &&
        !PoseTracker::IsChance(report.seen);
  }
  if (tracked) {
    pose_tracker_.RecheckWideStep(*view_, *last_, current_, report.seen);
  }
  tracked = tracked || (last_ && pose_tracker_.TrackWithoutPrediction(*view_, *last_, current_, report.seen));
  tracked = tracked && pose_tracker_.IsDetermined(*view_, current_);
  if (tracked) {
    motion_ = Motion();
    if (motion_) {
      shutter_.Learn(*current_.features, *motion_, ShutterObservations());
    }
  }
  velocity_.reset();
  if (tracked && current_.timestamp - last_->timestamp <= kMaxInterval) {
    velocity_ = {current_.T_camera_map * last_->T_camera_map.Inverse(), current_.index - last_->index};
  }
  return tracked;
}

// Returns the motion from the last frame to the current one, at constant velocity.
Rigid3d Tracker::PredictedMotion() const {
  const bool known = velocity_ && current_.timestamp - last_->timestamp <= kMaxInterval;
  return known ? velocity_->Across(current_.index - last_->index) : Rigid3d{};
}

// Returns the camera's motion since the last frame, or nothing if that frame is too old or too close in time.
std::optional<CameraMotion> Tracker::Motion() const {
  return shutter_.Motion(last_->T_camera_map, current_.T_camera_map, current_.timestamp - last_->timestamp);
}

std::vector<ShutterObservation> Tracker::ShutterObservations() const {
  std::vector<ShutterObservation> observations;
  for (std::size_t i = 0; i < current_.points.size(); ++i) {
    if (!view_->Has(current_.points[i])) {
      continue;
    }
    const Eigen::Vector3d p_camera = current_.T_camera_map * view_->Point(current_.points[i]).p_map;
    if (p_camera.z() > 0.0) {
      const double variance = pose_tracker_.Levels().Variance(current_.features->keypoints[i].octave);
      observations.push_back({static_cast<int>(i), p_camera, variance});
    }
  }
  return observations;
}

// Relocates the frame in any submap.
bool Tracker::Relocalize(const Frame& image, TrackingReport& report) {
  const StageTimes::Scope timer(times_, "tracking.relocalization");
  std::optional<Relocalizer::Found> found =
      relocalizer_.ByWords(pose_tracker_, atlas_, view_, last_, current_);
  if (!found && options_.relocalization.objects && !image.detections.empty()) {
    ObjectFrame boxes;
    boxes.camera = camera_;
    boxes.detections = image.detections;
    found = relocalizer_.ByObjects(pose_tracker_, camera_,
                                   SelectBoxes(boxes, object_options_.detections, 0.0), current_);
  }
  if (!found || !pose_tracker_.TrackLocalMap(*found->view, {.min_inliers = kMinRecoveryInliers}, found->frame,
                                             report.seen)) {
    return false;
  }
  current_ = found->frame;
  if (found->view->submap != submap_) {
    SwitchSubmap(found->view->submap, found->view, atlas_->origins.at(found->view->submap).S_map_origin);
  }
  ++counters_.relocalizations;
  lost_frames_ = 0;
  ShareBacklog(report);
  initializer_.Reset();
  return true;
}

void Tracker::ReportPose(int pending_keyframes, TrackingReport& report) {
  report.pose = current_.anchor;
  report.matches = MatchesOf(current_, pose_tracker_.Levels());
  if (NeedsKeyframe(pending_keyframes)) {
    report.keyframe = KeyframeCandidate{current_.features, current_.points};
    last_keyframe_index_ = current_.index;
    last_keyframe_time_ = current_.timestamp;
  }
  last_ = current_;
  untracked_.clear();
}

// Handles a frame without a pose: tries to begin a submap if there is none yet or tracking has been lost for
// long; else keeps the frame for backward tracking.
void Tracker::BeginSubmapOrWait(TrackingReport& report) {
  constexpr std::size_t kMaxUntracked = 150;  // frames kept for backward tracking
  report.seen = {};
  current_.ClearPoints();
  if (view_) {
    counters_.losses += lost_frames_ == 0 ? 1 : 0;
    ++lost_frames_;
    velocity_.reset();
  }
  std::unique_ptr<Map> map;
  if (!view_ || lost_frames_ > options_.submap_after) {
    const StageTimes::Scope timer(times_, "tracking.initialization");
    map = initializer_.Add(current_.index, current_.timestamp, current_.features);
  }
  if (!map) {
    untracked_.push_back(current_);
    if (untracked_.size() > kMaxUntracked) {
      untracked_.erase(untracked_.begin());
    }
    return;
  }
  TrackingView view = MakeTrackingView(*map);
  view.submap = submaps_begun_;
  view.objects = std::make_shared<const ObjectMapView>();
  SwitchSubmap(submaps_begun_++, std::make_shared<const TrackingView>(std::move(view)), {});
  const Keyframe& newest = map->At(map->NewestKeyframe());
  current_.points = newest.points;
  current_.T_camera_map = newest.T_camera_map;
  current_.anchor = {newest.id, {}, newest.scale};
  last_keyframe_index_ = current_.index;
  last_keyframe_time_ = current_.timestamp;
  lost_frames_ = 0;
  velocity_.reset();
  last_ = current_;
  ShareBacklog(report);
  report.pose = current_.anchor;
  report.initial_map = std::move(map);
}

void Tracker::ShareBacklog(TrackingReport& report) {
  if (!untracked_.empty()) {
    report.backlog = Backlog{current_, std::move(untracked_)};
    untracked_ = {};
  }
}

// Returns the number of points tracked in the current frame, in those of its reference keyframe.
double Tracker::TrackedShare() const {
  const bool young = view_->keyframes.size() <= 2;
  const std::vector<PointId>& points = view_->keyframes.at(current_.anchor.reference).points;
  const auto reference_points = std::ranges::count_if(
      points, [&](PointId id) { return id != kNoPoint && (young || view_->Point(id).well_observed); });
  return current_.inliers / std::max(1.0, static_cast<double>(reference_points));
}

bool Tracker::NeedsKeyframe(int pending_keyframes) const {
  constexpr double kRounding = 1e-3;  // s, of timestamps in files
  const KeyframeOptions& options = options_.keyframes;
  const std::int64_t interval = current_.index - last_keyframe_index_;
  const double tracked_share = TrackedShare();
  const bool too_soon = interval < options.min_interval && tracked_share >= kMinSharedView;
  const bool needed = current_.timestamp - last_keyframe_time_ > options.max_interval - kRounding ||
                      tracked_share < options.tracked_share || current_.inliers < options.min_points;
  if (too_soon || !needed) {
    return false;
  }
  const bool urgent = tracked_share < options.urgent_share && pending_keyframes <= options.max_pending;
  return pending_keyframes == 0 || urgent;
}

FrameStamp Tracker::StampOf(const Frame& frame) const {
  return {submap_, S_map_origin_, frame.index, frame.timestamp, frame.image_path};
}

ObjectFrame Tracker::MakeObjectFrame(const Frame& frame) const {
  ObjectFrame objects;
  objects.frame_index = frame.index;
  objects.T_map_camera = current_.T_camera_map.Inverse();
  objects.camera = camera_;
  objects.gray = frame.gray;
  if (options_.rolling_shutter.boxes && motion_ && shutter_.Readout() != 0.0) {
    objects.box_at_once = [shutter = shutter_, motion = *motion_](const Box2d& box, double depth) {
      return shutter.Correct(box, motion, depth);
    };
  }
  for (std::size_t i = 0; i < current_.points.size(); ++i) {
    if (view_->Has(current_.points[i])) {
      objects.points.push_back({current_.points[i], current_.features->keypoints[i].raw_pixel,
                                view_->Point(current_.points[i]).p_map});
    }
  }
  return objects;
}

// Tracks the objects in the frame's boxes if these are known; else queues the frame until they arrive.
void Tracker::TrackObjects(const Frame& frame, bool tracked, TrackingReport& report) {
  constexpr std::size_t kMaxWaiting = 300;  // frames; about 100 MB
  WaitingFrame waiting{{StampOf(frame), {}, {}}, std::nullopt};
  if (tracked) {
    waiting.objects = MakeObjectFrame(frame);
  }
  if (waiting_.size() == kMaxWaiting) {
    waiting_.pop_front();
  }
  waiting_.push_back(std::move(waiting));
  if (!frame.detections_follow) {
    report.objects = AddDetections(frame.index, frame.detections);
  }
}

std::optional<SeenObjects> Tracker::AddDetections(std::int64_t frame_index,
                                                  const std::vector<Detection>& detections) {
  while (!waiting_.empty() && waiting_.front().seen.frame_index < frame_index) {
    waiting_.pop_front();
  }
  if (waiting_.empty() || waiting_.front().seen.frame_index != frame_index) {
    return std::nullopt;
  }
  WaitingFrame waiting = std::move(waiting_.front());
  waiting_.pop_front();
  SeenObjects& seen = waiting.seen;
  features_.AddDetections(seen.timestamp, detections);
  for (const Detection& detection : detections) {
    seen.detections.push_back({detection, -1});
  }
  if (waiting.objects && MoveToPresentMap(waiting)) {
    const StageTimes::Scope timer(times_, "tracking.objects");
    const TrackingView& view = seen.submap == submap_ ? *view_ : *atlas_->submaps.at(seen.submap);
    waiting.objects->detections = detections;
    seen.observations = object_trackers_.at(seen.submap).Track(*waiting.objects, *view.objects, &times_);
    for (const ObjectObservation& o : seen.observations) {
      seen.detections[o.detection_index].object_id = o.object_id;
    }
  }
  return std::move(seen);
}

// Moves a waiting frame into the present map, which may have been moved or merged into an older one since.
// Returns false if its objects are no longer tracked.
bool Tracker::MoveToPresentMap(WaitingFrame& waiting) const {
  SeenObjects& seen = waiting.seen;
  if (!atlas_ || !atlas_->origins.contains(seen.submap)) {
    return seen.submap == submap_;  // the submap has just begun
  }
  const auto& [submap, S_map_origin] = atlas_->origins.at(seen.submap);
  if (!object_trackers_.contains(submap)) {
    return false;
  }
  if (submap == seen.submap && S_map_origin == seen.S_map_origin) {
    return true;
  }
  const Sim3d S_new_old = S_map_origin * seen.S_map_origin.Inverse();
  ObjectFrame& frame = *waiting.objects;
  frame.T_map_camera = S_new_old * frame.T_map_camera;
  for (TrackedPoint& point : frame.points) {
    point.p_map = S_new_old * point.p_map;
  }
  seen.submap = submap;
  seen.S_map_origin = atlas_->origins.at(submap).S_map_origin;
  return true;
}

}  // namespace sqslam
