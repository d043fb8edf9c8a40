#include "slam/mapping/completion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <ranges>
#include <set>
#include <utility>

#include "slam/estimation/reprojection_error.h"
#include "slam/estimation/sim3_estimation.h"
#include "slam/estimation/two_view.h"
#include "slam/mapping/local_mapping.h"
#include "slam/util/parallel.h"
#include "slam/util/statistics.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

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

// Returns how well the points agree with the pose of the frame, 0 to 1: the mean of 1 - error / limit.
double Agreement(const Camera& camera, const Map& map, const SharedPoints& shared,
                 const TrackedFrame& frame) {
  double sum = 0.0;
  for (const auto& [point, i] : shared.matches) {
    const Eigen::Vector3d p_camera = frame.T_camera_map * map.Point(point).p_map;
    const Keypoint& keypoint = frame.features->keypoints[i];
    if (p_camera.z() > 0.0) {
      const double error =
          SquaredError(camera, p_camera, keypoint.pixel, map.Levels().Variance(keypoint.octave));
      sum += std::max(0.0, 1.0 - error / kChi2TwoDof);
    }
  }
  return sum / static_cast<double>(shared.matches.size());
}

std::map<std::int64_t, KeyframeId> KeyframesByFrame(const Map& map) {
  std::map<std::int64_t, KeyframeId> by_frame;
  for (const auto& [id, keyframe] : map.Keyframes()) {
    by_frame[keyframe.frame_index] = id;
  }
  return by_frame;
}

}  // namespace

SharedPoints Completion::PointsShared(const Map& map, std::int64_t frame_index) const {
  const std::map<std::int64_t, KeyframeId> by_frame = KeyframesByFrame(map);
  std::map<int, std::map<PointId, int>> votes;  // by keypoint of the frame
  SharedPoints shared;
  std::size_t most = 0;
  for (const auto& [other, matches] : views_.MatchesOf(frame_index)) {
    const auto found = by_frame.find(other);
    if (found == by_frame.end()) {
      continue;
    }
    const Keyframe& keyframe = map.At(found->second);
    std::size_t count = 0;
    for (const auto& [own, theirs] : matches) {
      if (const PointId point = keyframe.points[theirs]; point != kNoPoint) {
        ++votes[own][point];
        ++count;
      }
    }
    if (count > most) {
      most = count;
      shared.reference = keyframe.id;
    }
  }
  for (const auto& [keypoint, points] : votes) {
    const auto best = std::ranges::max_element(points, {}, &std::pair<const PointId, int>::second);
    shared.matches.emplace_back(best->first, keypoint);
  }
  return shared;
}

std::optional<TrackedFrame> Completion::Locate(const TrackingView& view, const SharedPoints& shared,
                                               const LeftoverFrame& leftover, double max_deviation) const {
  constexpr int kMinInliers = 20;  // map points that must confirm the pose
  TrackedFrame frame = Untracked(leftover);
  const bool located = shared.reference != kNoKeyframe &&
                       tracker_.LocateFrom(view, shared.matches, shared.reference, kMinInliers, frame) &&
                       tracker_.IsDetermined(view, frame, max_deviation);
  return located ? std::optional(std::move(frame)) : std::nullopt;
}

std::optional<TrackedFrame> Completion::LocateByTwoViews(const Map& map,
                                                         const LeftoverFrame& leftover) const {
  constexpr int kKeyframes = 4;  // with most matches
  const std::map<std::int64_t, KeyframeId> by_frame = KeyframesByFrame(map);
  std::vector<std::pair<std::size_t, std::int64_t>> ranked;
  for (const auto& [other, matches] : views_.MatchesOf(leftover.index)) {
    if (by_frame.contains(other)) {
      ranked.emplace_back(matches.size(), other);
    }
  }
  std::ranges::sort(ranked, std::greater<>());
  const SharedPoints shared = PointsShared(map, leftover.index);
  std::optional<TrackedFrame> best;
  for (const auto& [count, other] : ranked | std::views::take(kKeyframes)) {
    const Keyframe& keyframe = map.At(by_frame.at(other));
    std::optional<TrackedFrame> frame =
        StepFrom(map, keyframe, views_.MatchesOf(other).at(leftover.index), shared, leftover);
    if (frame && (!best || frame->inliers > best->inliers)) {
      best = std::move(frame);
    }
  }
  return best;
}

std::optional<TrackedFrame> Completion::StepFrom(const Map& map, const Keyframe& keyframe,
                                                 const ImageMatches& pairs, const SharedPoints& shared,
                                                 const LeftoverFrame& leftover) const {
  constexpr int kMinCommon = 8;      // map points
  constexpr double kMaxError = 4.0;  // px at level 0, of their reprojection: the step's length is not exact
  // Of the points that the frame shares with any keyframe: those of this one alone agree with wrong steps
  // too.
  constexpr double kMinInlierShare = 0.5;
  TwoViewOptions two_view;
  two_view.min_points = 25;  // fewer than for a new map: the common points confirm the pose too
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
  for (const auto& [point, i] : shared.matches) {
    const Keypoint& keypoint = frame.features->keypoints[i];
    const double error = SquaredError(camera_, frame.T_camera_map * map.Point(point).p_map, keypoint.pixel,
                                      map.Levels().Variance(keypoint.octave));
    if (error <= kMaxError * kMaxError) {
      frame.points[i] = point;
      ++frame.inliers;
    }
  }
  const auto known = static_cast<double>(shared.matches.size());
  return frame.inliers >= kMinCommon && frame.inliers >= kMinInlierShare * known ? std::optional(frame)
                                                                                 : std::nullopt;
}

std::vector<CommonView> Completion::CommonViews(const Map& current, const Map& known) const {
  const std::map<std::int64_t, KeyframeId> by_frame = KeyframesByFrame(known);
  std::vector<CommonView> common;
  for (const auto& [id, keyframe] : current.Keyframes()) {
    for (const auto& [other, matches] : views_.MatchesOf(keyframe.frame_index)) {
      if (const auto found = by_frame.find(other); found != by_frame.end()) {
        common.push_back({id, found->second, static_cast<int>(matches.size())});
      }
    }
  }
  std::ranges::stable_sort(common, std::greater<>(), &CommonView::matches);
  return common;
}

std::optional<SubmapTie> Completion::Tie(const Map& current, const Map& known, const TrackingView& known_view,
                                         const std::vector<CommonView>& common) const {
  constexpr std::size_t kMaxKeyframes = 30;  // of `current`, those with most matches
  std::optional<SubmapTie> best;
  const auto consider = [&](const Keyframe& keyframe, const std::optional<TrackedFrame>& located) {
    std::optional<SubmapTie> tie = located ? TieFrom(current, keyframe, known, *located) : std::nullopt;
    if (tie && (!best || tie->shared_points > best->shared_points)) {
      best = std::move(tie);
    }
  };
  std::set<KeyframeId> tried;
  for (const CommonView& view : common) {
    if (tried.size() == kMaxKeyframes || !tried.insert(view.current).second) {
      continue;
    }
    const Keyframe& keyframe = current.At(view.current);
    const LeftoverFrame frame{keyframe.frame_index, keyframe.timestamp, keyframe.features};
    consider(keyframe, Locate(known_view, PointsShared(known, frame.index), frame));
    consider(keyframe, LocateByTwoViews(known, frame));
  }
  return best;
}

void Completion::AddNewPoints(Map& map, KeyframeId id) const {
  const std::map<std::int64_t, KeyframeId> by_frame = KeyframesByFrame(map);
  for (const auto& [other, matches] : views_.MatchesOf(map.At(id).frame_index)) {
    if (const auto found = by_frame.find(other); found != by_frame.end()) {
      CreatePoints(map, camera_, id, found->second, matches);
    }
  }
  FuseWithNeighbours(map, camera_, id);
}

std::vector<KeyframeId> Completion::LoopsAt(const Map& map, KeyframeId id) const {
  constexpr int kMinCommon = 20;         // matches with a map point on either side
  constexpr double kMaxSameShare = 0.5;  // of them, that are of the same map point
  const std::map<std::int64_t, KeyframeId> by_frame = KeyframesByFrame(map);
  const Keyframe& keyframe = map.At(id);
  std::vector<std::pair<int, KeyframeId>> loops;
  for (const auto& [other, matches] : views_.MatchesOf(keyframe.frame_index)) {
    const auto found = by_frame.find(other);
    if (found == by_frame.end()) {
      continue;
    }
    const Keyframe& known = map.At(found->second);
    int common = 0;
    int same = 0;
    for (const auto& [own, theirs] : matches) {
      const bool both = keyframe.points[own] != kNoPoint && known.points[theirs] != kNoPoint;
      common += both ? 1 : 0;
      same += both && keyframe.points[own] == known.points[theirs] ? 1 : 0;
    }
    if (common >= kMinCommon && same < kMaxSameShare * common) {
      loops.emplace_back(common, known.id);
    }
  }
  std::ranges::sort(loops, std::greater<>());
  return ToVector(loops | std::views::values);
}

std::vector<StartPair> Completion::AllStarts(const LeftoverFrames& frames) const {
  constexpr std::size_t kMaxPairs = 600;  // with most matches
  std::vector<StartPair> pairs;
  for (const auto& [index, frame] : frames.ByIndex()) {
    for (const auto& [other, matches] : views_.MatchesOf(index)) {
      if (index < other && frames.ByIndex().contains(other)) {
        pairs.push_back({index, other, matches, {}});
      }
    }
  }
  if (pairs.size() > kMaxPairs) {
    std::ranges::stable_sort(pairs, std::greater<>(),
                             [](const StartPair& pair) { return pair.matches.size(); });
    pairs.resize(kMaxPairs);
  }
  ParallelFor(pairs.size(), 0, [&](std::size_t i) {
    StartPair& pair = pairs[i];
    std::vector<TwoViewMatch> pixels;
    for (const auto& [a, b] : pair.matches) {
      pixels.push_back({views_.FeaturesOf(pair.first).keypoints[a].pixel,
                        views_.FeaturesOf(pair.second).keypoints[b].pixel});
    }
    pair.geometry = EstimateTwoView(camera_, pixels, {}).geometry.value_or(TwoViewGeometry());
  });
  std::erase_if(pairs, [](const StartPair& pair) { return pair.geometry.determined == 0; });
  std::ranges::stable_sort(pairs, std::less<>(),
                           [](const StartPair& pair) { return pair.geometry.direction_deviation; });
  return pairs;
}

std::vector<StartPair> Completion::Starts(const LeftoverFrames& frames) {
  constexpr std::size_t kMaxStarts = 8;
  constexpr std::int64_t kMinDistance = 3;  // frames between the beginnings of two
  if (!pairs_) {
    pairs_ = AllStarts(frames);
  }
  std::vector<StartPair> starts;
  for (const StartPair& pair : *pairs_) {
    const bool near = std::ranges::any_of(
        starts, [&](const StartPair& start) { return std::abs(start.first - pair.first) < kMinDistance; });
    if (!near && starts.size() < kMaxStarts && frames.ByIndex().contains(pair.first) &&
        frames.ByIndex().contains(pair.second)) {
      starts.push_back(pair);
    }
  }
  return starts;
}

double Completion::ThirdViewSupport(const Map& map, const LeftoverFrames& frames) const {
  constexpr std::size_t kMinShared = 12;  // points
  constexpr int kFrames = 6;              // that show most points
  std::vector<std::pair<SharedPoints, const LeftoverFrame*>> ranked;
  for (const auto& [index, frame] : frames.ByIndex()) {
    SharedPoints shared = PointsShared(map, index);
    const bool is_own =
        std::ranges::any_of(map.Keyframes() | std::views::values,
                            [&](const Keyframe& keyframe) { return keyframe.frame_index == index; });
    if (shared.matches.size() >= kMinShared && !is_own) {
      ranked.emplace_back(std::move(shared), &frame);
    }
  }
  if (ranked.empty()) {
    return 0.0;
  }
  std::ranges::stable_sort(ranked, std::greater<>(),
                           [](const auto& entry) { return entry.first.matches.size(); });
  const TrackingView view = MakeTrackingView(map);
  double sum = 0.0;
  int tried = 0;
  for (const auto& [shared, frame] : ranked | std::views::take(kFrames)) {
    const std::optional<TrackedFrame> located = Locate(view, shared, *frame);
    if (located) {
      sum += Agreement(camera_, map, shared, *located);
    }
    ++tried;
  }
  return sum / tried;
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
