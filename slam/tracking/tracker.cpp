#include "slam/tracking/tracker.h"

#include <algorithm>

#include "slam/features/matching.h"

namespace sqslam {

Tracker::Tracker(const Camera& camera, const TrackingOptions& options, const ObjectOptions& objects,
                 std::uint64_t seed, StageTimes& times)
    : camera_(camera),
      options_(options),
      levels_(options.features),
      extractor_(options.features),
      initializer_(camera, options.initialization, levels_),
      object_options_(objects),
      seed_(seed),
      object_tracker_(objects, seed),
      times_(times) {}

TrackingReport Tracker::Track(const Frame& frame, const TrackingViewPtr& view, int pending_keyframes) {
  const StageTimes::Scope timer(times_, "tracking");
  TrackingReport report;
  report.frame_index = frame.index;
  report.timestamp = frame.timestamp;
  report.image_path = frame.image_path;
  for (const Detection& detection : frame.detections) {
    report.detections.push_back({detection, -1});
  }
  current_ = {};
  current_.index = frame.index;
  current_.timestamp = frame.timestamp;
  {
    const StageTimes::Scope features_timer(times_, "tracking.features");
    current_.features =
        std::make_shared<const FrameFeatures>(extractor_.Extract(frame.gray, frame.bgr, camera_));
  }
  current_.points.assign(current_.features->Size(), kNoPoint);

  AdoptView(view);
  if (!view_) {
    Initialize(report);
  } else if (EstimatePose(report)) {
    const KeyframeDecision decision = DecideKeyframe(pending_keyframes);
    TrackObjects(frame, report);
    report.pose = current_.anchor;
    report.keyframe_postponed = decision == KeyframeDecision::kPostponed;
    if (decision == KeyframeDecision::kYes) {
      report.keyframe = KeyframeCandidate{current_.features, current_.points};
      last_keyframe_index_ = current_.index;
    }
    last_ = current_;
  } else {
    AfterLoss(report);
  }
  report.map_number = map_number_;
  return report;
}

void Tracker::Initialize(TrackingReport& report) {
  const StageTimes::Scope timer(times_, "tracking.initialization");
  std::unique_ptr<Map> map = initializer_.Add(current_.index, current_.timestamp, current_.features);
  if (!map) {
    return;
  }
  TrackingView view = MakeTrackingView(*map);
  view.map_number = map_number_;
  view.objects = std::make_shared<const ObjectMapView>();
  view_ = std::make_shared<const TrackingView>(std::move(view));
  const Keyframe& newest = map->At(map->NewestKeyframe());
  current_.points = newest.points;
  current_.T_camera_map = newest.T_camera_map;
  current_.anchor = {newest.id, {}};
  last_keyframe_index_ = current_.index;
  last_ = current_;
  velocity_.reset();
  report.pose = current_.anchor;
  report.initial_map = std::move(map);
}

// Takes the newest view of the map and moves the last pose along with its reference keyframe.
void Tracker::AdoptView(const TrackingViewPtr& view) {
  if (!view || !view_ || view->map_number != map_number_ || view == view_) {
    return;
  }
  const Rigid3d T_new_old = view->T_map_origin * view_->T_map_origin.Inverse();
  if (!T_new_old.rotation.isApprox(Eigen::Quaterniond::Identity(), 1e-12)) {
    object_tracker_.Transform(T_new_old);
  }
  view_ = view;
  if (last_) {
    last_->T_camera_map = last_->anchor.T_camera_reference * view_->PoseOf(last_->anchor.reference);
    for (PointId& point : last_->points) {
      point = view_->Resolve(point);
    }
  }
}

bool Tracker::EstimatePose(TrackingReport& report) {
  const StageTimes::Scope timer(times_, "tracking.pose");
  const bool was_lost = Lost();
  const bool tracked = was_lost ? Recover(report)
                                : (TrackMotion() || TrackReferenceKeyframe()) &&
                                      TrackLocalMap(1.0, options_.min_inliers, report);
  if (!tracked) {
    return false;
  }
  const bool consecutive = last_ && !was_lost && last_->index + 1 == current_.index;
  velocity_.reset();
  if (consecutive) {
    velocity_ = current_.T_camera_map * last_->T_camera_map.Inverse();
  }
  if (was_lost) {
    ++recoveries_;
    lost_frames_ = 0;
  }
  return true;
}

// Motion model: the last frame's map points, projected with constant velocity.
bool Tracker::TrackMotion() {
  constexpr int kFewMatches = 20;
  constexpr int kMinInliers = 10;
  if (!last_) {
    return false;
  }
  current_.T_camera_map = (velocity_ ? *velocity_ : Rigid3d{}) * last_->T_camera_map;
  for (const double widening : {1.0, 2.0, 4.0}) {
    std::vector<PredictedPoint> predictions;
    for (std::size_t i = 0; i < last_->points.size(); ++i) {
      const PointId id = last_->points[i];
      if (!view_->Has(id)) {
        continue;
      }
      const ViewPoint& point = view_->Point(id);
      const Eigen::Vector3d p_camera = current_.T_camera_map * point.p_map;
      if (p_camera.z() <= 0.0) {
        continue;
      }
      const Keypoint& keypoint = last_->features->keypoints[i];
      predictions.push_back({static_cast<int>(i), camera_.Project(p_camera),
                             widening * options_.motion_radius * levels_.Scale(keypoint.octave),
                             std::max(0, keypoint.octave - 1), keypoint.octave + 1,
                             &last_->features->descriptors[i], keypoint.angle});
    }
    std::fill(current_.points.begin(), current_.points.end(), kNoPoint);
    const auto matches = MatchPredictions(predictions, *current_.features, {}, kLooseDistance, 0.9);
    for (const PredictionMatch& match : matches) {
      current_.points[static_cast<std::size_t>(match.keypoint)] =
          last_->points[static_cast<std::size_t>(match.tag)];
    }
    if (static_cast<int>(matches.size()) >= kFewMatches) {
      Rigid3d predicted = current_.T_camera_map;
      if (OptimizeCurrentPose() >= kMinInliers) {
        return true;
      }
      current_.T_camera_map = predicted;
    }
  }
  return false;
}

// Where the motion model fails: descriptors of the reference keyframe, with no assumption on the motion.
bool Tracker::TrackReferenceKeyframe() {
  constexpr int kMinMatches = 15;
  constexpr int kMinInliers = 10;
  if (!last_) {
    return false;
  }
  const auto it = view_->keyframes.find(last_->anchor.reference);
  const ViewKeyframe& keyframe =
      it != view_->keyframes.end() ? it->second : view_->keyframes.rbegin()->second;
  std::vector<bool> use(keyframe.points.size());
  std::transform(keyframe.points.begin(), keyframe.points.end(), use.begin(),
                 [](PointId p) { return p != kNoPoint; });
  const auto matches = MatchAll(*keyframe.features, *current_.features, use, {}, kStrictDistance, 0.7);
  std::fill(current_.points.begin(), current_.points.end(), kNoPoint);
  for (const auto& [i, j] : matches) {
    current_.points[static_cast<std::size_t>(j)] = keyframe.points[static_cast<std::size_t>(i)];
  }
  if (static_cast<int>(matches.size()) < kMinMatches) {
    return false;
  }
  current_.T_camera_map = last_->T_camera_map;
  return OptimizeCurrentPose() >= kMinInliers;
}

// Searches the points of all keyframes that see the same part of the scene, and refines the pose with all of
// them.
bool Tracker::TrackLocalMap(double radius_factor, int min_inliers, TrackingReport& report) {
  constexpr double kMinViewCosine = 0.5;
  constexpr double kFrontalCosine = 0.998;
  const KeyframeId start = current_.anchor.reference != kNoKeyframe ? current_.anchor.reference
                           : last_                                  ? last_->anchor.reference
                                                                    : view_->keyframes.rbegin()->first;
  const LocalMap local = FindLocalMap(*view_, current_.points, start, options_.max_local_keyframes);
  std::vector<bool> matched(view_->points.size(), false);
  std::vector<bool> taken(current_.points.size(), false);
  for (std::size_t i = 0; i < current_.points.size(); ++i) {
    if (view_->Has(current_.points[i])) {
      matched[static_cast<std::size_t>(current_.points[i])] = true;
      taken[i] = true;
    }
  }
  const Eigen::Vector3d center = current_.T_camera_map.Inverse().translation;
  std::vector<PredictedPoint> predictions;
  for (const PointId id : local.points) {
    const ViewPoint& point = view_->Point(id);
    const Eigen::Vector3d p_camera = current_.T_camera_map * point.p_map;
    if (p_camera.z() <= 0.0) {
      continue;
    }
    const Eigen::Vector2d pixel = camera_.Project(p_camera);
    const Eigen::Vector3d ray = point.p_map - center;
    const double distance = ray.norm();
    const double cosine = ray.dot(point.normal) / distance;
    if (pixel.x() < 0.0 || pixel.y() < 0.0 || pixel.x() >= camera_.width || pixel.y() >= camera_.height ||
        distance < point.min_distance || distance > point.max_distance || cosine < kMinViewCosine) {
      continue;
    }
    report.visible.push_back(id);
    if (matched[static_cast<std::size_t>(id)]) {
      continue;
    }
    const int octave = levels_.PredictOctave(distance, point.max_distance);
    const double radius = radius_factor * (cosine > kFrontalCosine ? 2.5 : 4.0) * levels_.Scale(octave);
    predictions.push_back(
        {static_cast<int>(id), pixel, radius, std::max(0, octave - 1), octave, &point.descriptor, -1.0F});
  }
  for (const PredictionMatch& match :
       MatchPredictions(predictions, *current_.features, taken, kLooseDistance, 0.8)) {
    current_.points[static_cast<std::size_t>(match.keypoint)] = match.tag;
  }
  current_inliers_ = OptimizeCurrentPose();
  if (current_inliers_ < min_inliers) {
    return false;
  }
  for (const PointId point : current_.points) {
    if (point != kNoPoint) {
      report.found.push_back(point);
    }
  }
  const Rigid3d& T_reference_map = view_->PoseOf(local.reference);
  current_.anchor = {local.reference, current_.T_camera_map * T_reference_map.Inverse()};
  return true;
}

// Refines the pose from all matches and forgets the matches that don't fit; returns how many do.
int Tracker::OptimizeCurrentPose() {
  std::vector<PointObservation> observations;
  std::vector<std::size_t> keypoints;
  for (std::size_t i = 0; i < current_.points.size(); ++i) {
    if (!view_->Has(current_.points[i])) {
      current_.points[i] = kNoPoint;
      continue;
    }
    const Keypoint& keypoint = current_.features->keypoints[i];
    observations.push_back(
        {view_->Point(current_.points[i]).p_map, keypoint.pixel, levels_.Variance(keypoint.octave), true});
    keypoints.push_back(i);
  }
  const int inliers = OptimizePose(camera_, observations, current_.T_camera_map);
  for (std::size_t i = 0; i < observations.size(); ++i) {
    if (!observations[i].inlier) {
      current_.points[keypoints[i]] = kNoPoint;
    }
  }
  return inliers;
}

// A young map that tracking can't get back to is given up; an older one is kept for recovery.
void Tracker::AfterLoss(TrackingReport& report) {
  losses_ += lost_frames_ == 0 ? 1 : 0;
  ++lost_frames_;
  velocity_.reset();
  report.visible.clear();
  report.found.clear();
  if (static_cast<int>(view_->keyframes.size()) < options_.reset_keyframes &&
      lost_frames_ >= options_.reset_frames) {
    ++resets_;
    ++map_number_;
    view_.reset();
    last_.reset();
    lost_frames_ = 0;
    object_tracker_ = ObjectTracker(object_options_, seed_);
  }
}

Tracker::KeyframeDecision Tracker::DecideKeyframe(int pending_keyframes) const {
  const KeyframeOptions& options = options_.keyframes;
  const std::int64_t interval = current_.index - last_keyframe_index_;
  if (interval < options.min_interval) {
    return KeyframeDecision::kNo;
  }
  const bool young = view_->keyframes.size() <= 2;
  const std::vector<PointId>& points = view_->keyframes.at(current_.anchor.reference).points;
  const auto reference_points = std::count_if(points.begin(), points.end(), [&](PointId id) {
    return id != kNoPoint && (young || view_->Point(id).well_observed);
  });
  const double tracked_share = current_inliers_ / std::max(1.0, static_cast<double>(reference_points));
  if (interval < options.max_interval && tracked_share >= options.tracked_share) {
    return KeyframeDecision::kNo;
  }
  const bool urgent = tracked_share < options.urgent_share && pending_keyframes <= options.max_pending;
  return pending_keyframes == 0 || urgent ? KeyframeDecision::kYes : KeyframeDecision::kPostponed;
}

void Tracker::TrackObjects(const Frame& frame, TrackingReport& report) {
  const StageTimes::Scope timer(times_, "tracking.objects");
  ObjectFrame object_frame;
  object_frame.frame_index = frame.index;
  object_frame.timestamp = frame.timestamp;
  object_frame.T_map_camera = current_.T_camera_map.Inverse();
  object_frame.camera = camera_;
  object_frame.detections = frame.detections;
  object_frame.gray = frame.gray;
  for (std::size_t i = 0; i < current_.points.size(); ++i) {
    if (view_->Has(current_.points[i])) {
      object_frame.points.push_back({current_.points[i], current_.features->keypoints[i].raw_pixel,
                                     view_->Point(current_.points[i]).p_map});
    }
  }
  report.objects = object_tracker_.Track(object_frame, *view_->objects, &times_);
  report.T_map_origin = view_->T_map_origin;
  for (const ObjectObservation& o : report.objects) {
    report.detections[static_cast<std::size_t>(o.detection_index)].object_id = o.object_id;
  }
}

}  // namespace sqslam
