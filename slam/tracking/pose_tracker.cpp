#include "slam/tracking/pose_tracker.h"

#include <Eigen/LU>
#include <algorithm>
#include <functional>
#include <ranges>

#include "slam/estimation/absolute_pose.h"
#include "slam/util/statistics.h"

namespace sqslam {
namespace {

constexpr int kMinInliers = 10;
constexpr int kMaxLocalKeyframes = 40;  // whose points are searched in each frame

// Returns pairs (keypoint of the known view that has a map point, keypoint of the frame).
std::vector<std::pair<int, int>> MatchDescriptors(const FrameFeatures& known,
                                                  const std::vector<PointId>& points,
                                                  const TrackedFrame& frame, double ratio) {
  return MatchAll(known, *frame.features, HavePoints(points), {}, kMaxUnguidedDistance, ratio);
}

}  // namespace

const ViewKeyframe& ExistingKeyframe(const TrackingView& view, KeyframeId id) {
  const auto it = view.keyframes.find(id);
  return it != view.keyframes.end() ? it->second : view.keyframes.rbegin()->second;
}

LocalMap FindLocalMap(const TrackingView& view, const std::vector<PointId>& points, KeyframeId last_reference,
                      int max_keyframes) {
  std::vector<bool> seen(view.points.IdBound(), false);
  for (const PointId point : points) {
    if (view.Has(point)) {
      seen[point] = true;
    }
  }
  const ViewKeyframe& start = ExistingKeyframe(view, last_reference);
  std::set<KeyframeId> candidates{start.id};
  for (const KeyframeId near : start.covisible) {
    candidates.insert(near);
    const auto& further = view.keyframes.at(near).covisible;
    candidates.insert(further.begin(), further.end());
  }
  std::vector<std::pair<int, KeyframeId>> ranked;
  for (const KeyframeId id : candidates) {
    int shared = 0;
    for (const PointId point : view.keyframes.at(id).points) {
      shared += point != kNoPoint && seen[point] ? 1 : 0;
    }
    ranked.emplace_back(shared, id);
  }
  std::ranges::sort(ranked, std::greater<>());
  LocalMap local;
  local.reference = ranked.front().first > 0 ? ranked.front().second : start.id;
  std::vector<bool> added(view.points.IdBound(), false);
  for (const auto& [shared, id] : ranked | std::views::take(max_keyframes)) {
    for (const PointId point : view.keyframes.at(id).points) {
      if (point != kNoPoint && !added[point]) {
        added[point] = true;
        local.points.push_back(point);
      }
    }
  }
  return local;
}

PoseTracker::PoseTracker(const Camera& camera, const TrackingOptions& options)
    : camera_(camera), options_(options), levels_(options.features) {}

bool PoseTracker::TrackMotion(const TrackingView& view, const TrackedFrame& last, const Rigid3d& T_frame_last,
                              TrackedFrame& frame) const {
  constexpr int kMinMatches = 20;
  const Rigid3d predicted = T_frame_last * last.T_camera_map;
  for (const double widening : {1.0, 2.0, 4.0}) {
    frame.T_camera_map = predicted;
    std::vector<PredictedPoint> predictions;
    for (std::size_t i = 0; i < last.points.size(); ++i) {
      if (!view.Has(last.points[i])) {
        continue;
      }
      const Eigen::Vector3d p_camera = predicted * view.Point(last.points[i]).p_map;
      if (p_camera.z() <= 0.0) {
        continue;
      }
      const Keypoint& keypoint = last.features->keypoints[i];
      predictions.push_back({static_cast<int>(i), camera_.Project(p_camera),
                             widening * options_.motion_radius * levels_.Scale(keypoint.octave),
                             keypoint.octave, &last.features->descriptors[i], keypoint.angle});
    }
    frame.ClearPoints();
    const auto matches = MatchPredictions(predictions, *frame.features, {}, kMaxGuidedDistance, 0.9);
    for (const auto& [i, keypoint] : matches) {
      frame.points[keypoint] = last.points[i];
    }
    if (static_cast<int>(matches.size()) >= kMinMatches && Optimize(view, kMinInliers, frame)) {
      frame.anchor.reference = last.anchor.reference;
      return true;
    }
  }
  return false;
}

bool PoseTracker::TrackReferenceKeyframe(const TrackingView& view, const TrackedFrame& last,
                                         TrackedFrame& frame) const {
  constexpr int kMinMatches = 15;
  const ViewKeyframe& keyframe = ExistingKeyframe(view, last.anchor.reference);
  const auto matches = MatchDescriptors(*keyframe.features, keyframe.points, frame, 0.7);
  frame.ClearPoints();
  for (const auto& [i, j] : matches) {
    frame.points[j] = keyframe.points[i];
  }
  frame.T_camera_map = last.T_camera_map;
  frame.anchor.reference = keyframe.id;
  return static_cast<int>(matches.size()) >= kMinMatches && Optimize(view, kMinInliers, frame);
}

bool PoseTracker::TrackLocalMap(const TrackingView& view, const LocalSearch& search, TrackedFrame& frame,
                                SeenPoints& seen) const {
  constexpr double kFrontalCosine = 0.998;
  seen = {};
  const LocalMap local = FindLocalMap(view, frame.points, frame.anchor.reference, kMaxLocalKeyframes);
  if (search.discard_matches) {
    frame.ClearPoints();
  }
  std::vector<bool> matched(view.points.IdBound(), false);
  std::vector<bool> taken(frame.points.size(), false);
  for (std::size_t i = 0; i < frame.points.size(); ++i) {
    if (view.Has(frame.points[i])) {
      matched[frame.points[i]] = true;
      taken[i] = true;
    }
  }
  const Eigen::Vector3d center = frame.T_camera_map.Inverse().translation;
  std::vector<PredictedPoint> predictions;
  for (const PointId id : local.points) {
    const ViewPoint& point = view.Point(id);
    const std::optional<PredictedSight> sight = PredictSight(point, camera_, frame.T_camera_map, center);
    if (!sight) {
      continue;
    }
    seen.visible.push_back(id);
    if (!matched[id]) {
      const int octave = levels_.PredictOctave(sight->distance, point.level_zero_distance);
      const double radius =
          search.radius_factor * (sight->cosine > kFrontalCosine ? 2.5 : 4.0) * levels_.Scale(octave);
      predictions.push_back({static_cast<int>(id), sight->pixel, radius, octave, &point.descriptor, -1.0F});
    }
  }
  for (const auto& [id, keypoint] :
       MatchPredictions(predictions, *frame.features, taken, search.max_distance, 0.8)) {
    frame.points[keypoint] = id;
  }
  if (!Optimize(view, search.min_inliers, frame)) {
    return false;
  }
  std::ranges::copy_if(frame.points, std::back_inserter(seen.found),
                       [](PointId point) { return point != kNoPoint; });
  const ScaledPose reference = view.PoseOf(local.reference);
  frame.anchor = {local.reference, frame.T_camera_map * reference.T_camera_map.Inverse(), reference.scale};
  return true;
}

bool PoseTracker::LocateFrom(const TrackingView& view, const FrameFeatures& known,
                             const std::vector<PointId>& known_points, TrackedFrame& frame) const {
  constexpr int kIterations = 300;
  std::vector<std::pair<PointId, int>> matches;
  for (const auto& [i, j] : MatchDescriptors(known, known_points, frame, 0.75)) {
    matches.emplace_back(known_points[i], j);
  }
  return LocateByMatches(view, matches, kIterations, frame);
}

// `matches`: pairs of a map point and a keypoint of the frame.
bool PoseTracker::LocateByMatches(const TrackingView& view,
                                  const std::vector<std::pair<PointId, int>>& matches, int iterations,
                                  TrackedFrame& frame) const {
  constexpr std::size_t kMinMatches = 15;
  if (matches.size() < kMinMatches) {
    return false;
  }
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector2d> pixels;
  for (const auto& [point, keypoint] : matches) {
    points.push_back(view.Point(point).p_map);
    pixels.push_back(frame.features->keypoints[keypoint].pixel);
  }
  std::vector<int> inliers;
  const std::optional<Rigid3d> T_camera_map = LocateByP3P(camera_, points, pixels, iterations, inliers);
  if (!T_camera_map || static_cast<int>(inliers.size()) < kMinInliers) {
    return false;
  }
  frame.T_camera_map = *T_camera_map;
  frame.ClearPoints();
  for (const int inlier : inliers) {
    const auto& [point, keypoint] = matches[inlier];
    frame.points[keypoint] = point;
  }
  return Optimize(view, kMinInliers, frame);
}

bool PoseTracker::Relocate(const TrackingView& view, const ViewKeyframe& keyframe,
                           TrackedFrame& frame) const {
  SeenPoints seen;
  frame.anchor = {keyframe.id, {}, keyframe.pose.scale};
  return LocateFrom(view, *keyframe.features, keyframe.points, frame) &&
         ConfirmPose(view, kMinRecoveryInliers / 2, frame, seen);
}

bool PoseTracker::LocateNear(const TrackingView& view, const Rigid3d& T_camera_map, KeyframeId reference,
                             double radius, TrackedFrame& frame) const {
  constexpr int kIterations = 1000;
  const Eigen::Vector3d center = T_camera_map.Inverse().translation;
  std::vector<PredictedPoint> predictions;
  for (const PointId id : FindLocalMap(view, {}, reference, kMaxLocalKeyframes).points) {
    const ViewPoint& point = view.Point(id);
    if (const std::optional<PredictedSight> sight = PredictSight(point, camera_, T_camera_map, center)) {
      const int octave = levels_.PredictOctave(sight->distance, point.level_zero_distance);
      predictions.push_back({static_cast<int>(id), sight->pixel, radius, octave, &point.descriptor, -1.0F});
    }
  }
  std::vector<std::pair<PointId, int>> matches;
  for (const auto& [id, keypoint] :
       MatchPredictions(predictions, *frame.features, {}, kMaxGuidedDistance, 0.8)) {
    matches.emplace_back(id, keypoint);
  }
  SeenPoints seen;
  frame.anchor = {reference, {}, view.PoseOf(reference).scale};
  return LocateByMatches(view, matches, kIterations, frame) &&
         ConfirmPose(view, kMinRecoveryInliers / 2, frame, seen);
}

bool PoseTracker::TrackWithoutPrediction(const TrackingView& view, const TrackedFrame& last,
                                         TrackedFrame& frame, SeenPoints& seen) const {
  std::vector<PointId> points = last.points;
  std::ranges::replace_if(
      points, [&](PointId point) { return !view.Has(point); }, kNoPoint);
  frame.anchor = last.anchor;
  if (LocateFrom(view, *last.features, points, frame) &&
      ConfirmPose(view, kMinRecoveryInliers / 2, frame, seen)) {
    return true;
  }
  constexpr int kNewestKeyframes = 2;  // may show points that have just come into view
  std::vector<KeyframeId> keyframes{ExistingKeyframe(view, last.anchor.reference).id};
  for (const auto& [id, keyframe] :
       view.keyframes | std::views::reverse | std::views::take(kNewestKeyframes)) {
    keyframes.push_back(id);
  }
  return std::ranges::any_of(keyframes, [&](KeyframeId id) {
    const ViewKeyframe& keyframe = view.keyframes.at(id);
    frame.anchor = {id, {}, keyframe.pose.scale};
    return LocateFrom(view, *keyframe.features, keyframe.points, frame) &&
           ConfirmPose(view, kMinRecoveryInliers / 2, frame, seen);
  });
}

bool PoseTracker::LocateFrom(const TrackingView& view, const std::vector<std::pair<PointId, int>>& matches,
                             KeyframeId reference, int min_inliers, TrackedFrame& frame) const {
  constexpr int kIterations = 2000;
  if (!LocateByMatches(view, matches, kIterations, frame)) {
    return false;
  }
  frame.anchor = {reference, {}, view.keyframes.at(reference).pose.scale};
  SeenPoints seen;
  return ConfirmPose(view, min_inliers, frame, seen);
}

// Searches the local map with the strict descriptor threshold only: with the loose one, a wrong pose finds
// enough chance matches to look confirmed.
bool PoseTracker::ConfirmPose(const TrackingView& view, int min_inliers, TrackedFrame& frame,
                              SeenPoints& seen) const {
  constexpr double kRadiusFactor = 3.0;
  const LocalSearch wide{kRadiusFactor, kMaxUnguidedDistance, false,
                         std::min(min_inliers, options_.min_inliers)};
  const LocalSearch again{1.0, kMaxUnguidedDistance, true, min_inliers};
  return TrackLocalMap(view, wide, frame, seen) && TrackLocalMap(view, again, frame, seen);
}

bool PoseTracker::IsChance(const SeenPoints& seen) {
  constexpr double kMinFoundShare = 0.15;
  return static_cast<double>(seen.found.size()) < kMinFoundShare * static_cast<double>(seen.visible.size());
}

bool PoseTracker::IsDetermined(const TrackingView& view, const TrackedFrame& frame,
                               double max_deviation) const {
  std::vector<Eigen::Vector3d> p_map;
  for (const PointId point : frame.points) {
    if (point != kNoPoint) {
      p_map.push_back(view.Point(point).p_map);
    }
  }
  return CornerDeviation(camera_, frame.T_camera_map, p_map) <= max_deviation;
}

void PoseTracker::RecheckWideStep(const TrackingView& view, const TrackedFrame& last, TrackedFrame& frame,
                                  SeenPoints& seen) const {
  constexpr double kMaxStep = 0.03;        // of the image width
  constexpr double kMinFoundShare = 0.35;  // of the points that should be seen
  const auto found = static_cast<double>(seen.found.size());
  if (found >= kMinFoundShare * static_cast<double>(seen.visible.size())) {
    return;
  }
  std::vector<double> steps;
  for (const PointId id : seen.found) {
    const Eigen::Vector3d& p_map = view.Point(id).p_map;
    const Eigen::Vector3d before = last.T_camera_map * p_map;
    if (before.z() > 0.0) {
      steps.push_back((camera_.Project(frame.T_camera_map * p_map) - camera_.Project(before)).norm());
    }
  }
  if (!steps.empty() && UpperMedian(std::move(steps)) < kMaxStep * camera_.width) {
    return;
  }
  TrackedFrame other = frame;
  SeenPoints other_seen;
  if (TrackWithoutPrediction(view, last, other, other_seen) &&
      TrackLocalMap(view, {.min_inliers = options_.min_inliers}, other, other_seen) &&
      other.inliers > frame.inliers) {
    frame = std::move(other);
    seen = std::move(other_seen);
  }
}

// Refines the pose from all matches and drops the outliers.
bool PoseTracker::Optimize(const TrackingView& view, int min_inliers, TrackedFrame& frame) const {
  std::vector<PointObservation> observations;
  std::vector<std::size_t> keypoints;
  for (std::size_t i = 0; i < frame.points.size(); ++i) {
    if (!view.Has(frame.points[i])) {
      frame.points[i] = kNoPoint;
      continue;
    }
    const Keypoint& keypoint = frame.features->keypoints[i];
    observations.push_back(
        {view.Point(frame.points[i]).p_map, keypoint.pixel, levels_.Variance(keypoint.octave), true});
    keypoints.push_back(i);
  }
  frame.inliers = OptimizePose(camera_, observations, frame.T_camera_map);
  for (std::size_t i = 0; i < observations.size(); ++i) {
    if (!observations[i].inlier) {
      frame.points[keypoints[i]] = kNoPoint;
    }
  }
  return frame.inliers >= min_inliers;
}

std::vector<FrameMatch> MatchesOf(const TrackedFrame& frame, const ScaleLevels& levels) {
  std::vector<FrameMatch> matches;
  for (std::size_t i = 0; i < frame.points.size(); ++i) {
    if (frame.points[i] != kNoPoint) {
      const Keypoint& keypoint = frame.features->keypoints[i];
      matches.push_back({frame.points[i], keypoint.pixel.cast<float>(),
                         static_cast<float>(levels.Sigma(keypoint)),
                         static_cast<float>(levels.Scale(keypoint.octave)), static_cast<int>(i)});
    }
  }
  return matches;
}

Rigid3d RefineFrame(const Map& map, const Camera& camera, const std::vector<FrameMatch>& matches,
                    int min_inliers, const Rigid3d& T_camera_map) {
  std::vector<PointObservation> observations;
  for (const FrameMatch& match : matches) {
    if (const PointId point = map.Resolve(match.point); point != kNoPoint) {
      observations.push_back(
          {map.Point(point).p_map, match.pixel.cast<double>(), match.sigma * match.sigma, true});
    }
  }
  Rigid3d refined = T_camera_map;
  const bool enough = static_cast<int>(observations.size()) >= min_inliers &&
                      OptimizePose(camera, observations, refined) >= min_inliers;
  return enough ? refined : T_camera_map;
}

std::vector<TrackedFrame> TrackBackward(const PoseTracker& tracker, const TrackingView& view,
                                        const Backlog& backlog, int min_inliers) {
  constexpr int kMaxFailures = 10;  // frames in a row without a pose
  TrackedFrame last = backlog.next;
  last.T_camera_map = Resolve(last.anchor, view.PoseOf(last.anchor.reference)).T_camera_map;
  for (PointId& point : last.points) {
    point = view.Resolve(point);
  }
  std::vector<TrackedFrame> tracked;
  std::optional<Rigid3d> velocity;
  int failures = 0;
  for (const TrackedFrame& frame : std::views::reverse(backlog.earlier)) {
    TrackedFrame current = frame;
    SeenPoints seen;
    const bool found = (tracker.TrackMotion(view, last, velocity.value_or(Rigid3d{}), current) ||
                        tracker.TrackReferenceKeyframe(view, last, current)) &&
                       tracker.TrackLocalMap(view, {.min_inliers = min_inliers}, current, seen) &&
                       !PoseTracker::IsChance(seen) && tracker.IsDetermined(view, current);
    if (!found) {
      velocity.reset();
      if (++failures == kMaxFailures) {
        break;
      }
      continue;
    }
    tracker.RecheckWideStep(view, last, current, seen);
    velocity = current.T_camera_map * last.T_camera_map.Inverse();
    failures = 0;
    tracked.push_back(current);
    last = std::move(current);
  }
  return tracked;
}

}  // namespace sqslam
