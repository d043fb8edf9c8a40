#include "slam/mapping/completion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <ranges>
#include <utility>

#include "slam/estimation/reprojection_error.h"
#include "slam/estimation/sim3_estimation.h"
#include "slam/estimation/two_view.h"
#include "slam/features/matching.h"
#include "slam/mapping/local_mapping.h"
#include "slam/util/statistics.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

// Returns the number of frames between a frame and the map's nearest keyframe in time.
std::int64_t TimeDistance(const Map& map, std::int64_t frame_index) {
  std::int64_t nearest = std::numeric_limits<std::int64_t>::max();
  for (const auto& [id, keyframe] : map.Keyframes()) {
    nearest = std::min(nearest, std::abs(keyframe.frame_index - frame_index));
  }
  return nearest;
}

// Ratio of the units of length of two maps (first over second), from the distances of common points to a
// camera with a pose in both, and the matches that agree with it.
struct CommonScale {
  double scale = 1.0;
  std::vector<Sim3Match> matches;
};

std::optional<CommonScale> FindCommonScale(const std::vector<Sim3Match>& matches, int min_matches) {
  constexpr double kMaxDeviation = 0.2;  // of a match's ratio from the median
  if (static_cast<int>(matches.size()) < min_matches) {
    return std::nullopt;
  }
  const auto ratio = [](const Sim3Match& match) { return match.p_camera1.norm() / match.p_camera2.norm(); };
  CommonScale common{UpperMedian(ToVector(matches, ratio)), {}};
  std::ranges::copy_if(matches, std::back_inserter(common.matches), [&](const Sim3Match& match) {
    return std::abs(ratio(match) / common.scale - 1.0) <= kMaxDeviation;
  });
  const bool agreed =
      static_cast<int>(common.matches.size()) >= min_matches && 2 * common.matches.size() >= matches.size();
  return agreed ? std::optional(std::move(common)) : std::nullopt;
}

TrackedFrame Untracked(const LeftoverFrame& leftover) {
  TrackedFrame frame;
  frame.index = leftover.index;
  frame.timestamp = leftover.timestamp;
  frame.features = leftover.features;
  frame.ClearPoints();
  return frame;
}

// Returns up to `count` keyframes before and as many after a frame.
std::set<KeyframeId> NextInTime(const Map& map, std::int64_t frame_index, int count) {
  std::map<std::int64_t, KeyframeId> by_frame;
  for (const auto& [id, keyframe] : map.Keyframes()) {
    by_frame[keyframe.frame_index] = id;
  }
  std::set<KeyframeId> ids;
  const auto next = by_frame.lower_bound(frame_index);
  for (const auto& [index, id] : std::ranges::subrange(next, by_frame.end()) | std::views::take(count)) {
    ids.insert(id);
  }
  for (const auto& [index, id] :
       std::ranges::subrange(by_frame.begin(), next) | std::views::reverse | std::views::take(count)) {
    ids.insert(id);
  }
  return ids;
}

}  // namespace

std::vector<std::int64_t> Completion::ByDistanceInTime(const Map& map, const LeftoverFrames& frames) const {
  std::vector<std::int64_t> indices = frames.Indices();
  std::ranges::stable_sort(indices, {}, [&](std::int64_t index) { return TimeDistance(map, index); });
  return indices;
}

std::set<KeyframeId> Completion::Candidates(const Map& map, std::int64_t frame_index,
                                            const FrameFeatures& features) const {
  constexpr int kNeighbours = 4;  // keyframes before the frame and after it
  constexpr int kSimilar = 6;     // keyframes of similar appearance
  std::set<KeyframeId> candidates = NextInTime(map, frame_index, kNeighbours);
  for (const KeyframeId id : places_.MostSimilar(map, features, kSimilar)) {
    candidates.insert(id);
  }
  return candidates;
}

std::optional<TrackedFrame> Completion::Locate(const Map& map, const TrackingView& view,
                                               const LeftoverFrame& leftover) const {
  constexpr int kMinInliers = 20;  // map points that must confirm the pose
  TrackedFrame frame = Untracked(leftover);
  const bool found =
      tracker_.LocateAmong(view, Candidates(map, leftover.index, *leftover.features), kMinInliers, frame);
  return found ? std::optional(std::move(frame)) : std::nullopt;
}

std::optional<TrackedFrame> Completion::LocateByTwoViews(const Map& map,
                                                         const LeftoverFrame& leftover) const {
  constexpr int kNeighbours = 2;
  std::optional<TrackedFrame> best;
  for (const KeyframeId id : NextInTime(map, leftover.index, kNeighbours)) {
    std::optional<TrackedFrame> frame = StepFrom(map, map.At(id), leftover);
    if (frame && (!best || frame->inliers > best->inliers)) {
      best = std::move(frame);
    }
  }
  return best;
}

std::optional<TrackedFrame> Completion::StepFrom(const Map& map, const Keyframe& keyframe,
                                                 const LeftoverFrame& leftover) const {
  constexpr double kRatio = 0.85;
  constexpr int kMaxDistance = 64;   // bits
  constexpr int kMinCommon = 8;      // map points
  constexpr double kMaxError = 4.0;  // px at level 0, of their reprojection: the step's length is not exact
  constexpr double kMinInlierShare = 0.5;  // of the map points that were matched
  TwoViewOptions two_view;
  two_view.min_points = 25;  // fewer than for a new map: the common points confirm the pose too
  const auto pairs = MatchAll(*keyframe.features, *leftover.features, {}, {}, kMaxDistance, kRatio);
  std::vector<TwoViewMatch> matches;
  for (const auto& [i, j] : pairs) {
    matches.push_back({keyframe.features->keypoints[i].pixel, leftover.features->keypoints[j].pixel});
  }
  const std::optional<TwoViewGeometry> step = EstimateTwoView(camera_, matches, two_view).geometry;
  if (!step) {
    return std::nullopt;
  }
  const Eigen::Vector2d none = Eigen::Vector2d::Zero();  // pixels don't affect the scale
  std::vector<Sim3Match> common_points;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const PointId point = keyframe.points[pairs[k].first];
    if (step->points[k] && point != kNoPoint) {
      common_points.push_back({keyframe.T_camera_map * map.Point(point).p_map, *step->points[k], none, none});
    }
  }
  const std::optional<CommonScale> common = FindCommonScale(common_points, kMinCommon);
  if (!common) {
    return std::nullopt;
  }
  Rigid3d T_frame_keyframe = step->T_camera2_camera1;
  T_frame_keyframe.translation *= common->scale;
  TrackedFrame frame = Untracked(leftover);
  frame.T_camera_map = T_frame_keyframe * keyframe.T_camera_map;
  frame.anchor = {keyframe.id, T_frame_keyframe, keyframe.scale};
  int known = 0;
  for (const auto& [i, j] : pairs) {
    if (keyframe.points[i] != kNoPoint) {
      const Keypoint& keypoint = frame.features->keypoints[j];
      const double error = SquaredError(camera_, frame.T_camera_map * map.Point(keyframe.points[i]).p_map,
                                        keypoint.pixel, map.Levels().Variance(keypoint.octave));
      ++known;
      if (error <= kMaxError * kMaxError) {
        frame.points[j] = keyframe.points[i];
        ++frame.inliers;
      }
    }
  }
  return frame.inliers >= kMinCommon && frame.inliers >= kMinInlierShare * known ? std::optional(frame)
                                                                                 : std::nullopt;
}

// Returns the keyframes of `current` nearest in time to the other map, nearest first.
std::vector<KeyframeId> Completion::NearestInTime(const Map& current, const Map& known) const {
  constexpr int kMaxAttempts = 30;
  std::vector<std::pair<std::int64_t, KeyframeId>> ranked;
  for (const auto& [id, keyframe] : current.Keyframes()) {
    ranked.emplace_back(TimeDistance(known, keyframe.frame_index), id);
  }
  std::ranges::sort(ranked);
  return ToVector(ranked | std::views::take(kMaxAttempts) | std::views::values);
}

std::optional<SubmapTie> Completion::Tie(const Map& current, const Map& known,
                                         const TrackingView& known_view) const {
  std::optional<SubmapTie> best;
  for (const KeyframeId id : NearestInTime(current, known)) {
    const Keyframe& keyframe = current.At(id);
    const std::optional<TrackedFrame> located =
        Locate(known, known_view, {keyframe.frame_index, keyframe.timestamp, keyframe.features});
    if (!located) {
      continue;
    }
    std::optional<SubmapTie> tie = TieFrom(current, keyframe, known, *located);
    if (tie && (!best || tie->shared_points > best->shared_points)) {
      best = std::move(tie);
    }
  }
  return best;
}

std::optional<SubmapTie> Completion::TieFrom(const Map& current, const Keyframe& keyframe, const Map& known,
                                             const TrackedFrame& located) const {
  std::vector<Sim3Match> matches;
  SubmapTie tie;
  std::set<PointId> points;
  for (std::size_t i = 0; i < located.points.size(); ++i) {
    const PointId point = located.points[i];
    if (point == kNoPoint) {
      continue;
    }
    points.insert(point);
    tie.loop.confirmed.emplace_back(point, static_cast<int>(i));
    if (keyframe.points[i] == kNoPoint) {
      continue;
    }
    const Keypoint& keypoint = keyframe.features->keypoints[i];
    const double variance = known.Levels().Variance(keypoint.octave);
    matches.push_back({keyframe.T_camera_map * current.Point(keyframe.points[i]).p_map,
                       located.T_camera_map * known.Point(point).p_map, keypoint.pixel, keypoint.pixel,
                       variance, variance});
  }
  const std::optional<CommonScale> common = FindCommonScale(matches, kMinSharedPoints);
  if (!common) {
    return std::nullopt;
  }
  // Both poses are of the same camera: only the scale differs.
  Sim3d S_current_located{common->scale, Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero()};
  std::vector<bool> inliers;
  RefineSim3(camera_, common->matches, S_current_located, inliers);
  const KeyframeId reference = located.anchor.reference;
  tie.loop.current = keyframe.id;
  tie.loop.known = reference;
  tie.loop.S_current_known = S_current_located * Sim3d::FromRigid(located.T_camera_map) *
                             Sim3d::FromRigid(known.At(reference).T_camera_map).Inverse();
  points.merge(PointsOf(known, reference));
  tie.loop.known_points.assign(points.begin(), points.end());
  tie.shared_points = static_cast<int>(common->matches.size());
  return tie;
}

}  // namespace sqslam
