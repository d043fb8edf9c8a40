#include "slam/estimation/bundle_adjustment.h"

#include <algorithm>
#include <map>
#include <ranges>
#include <set>

#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

// Adds the frames' poses and their observations of the problem's points, which constrain the points better
// than keyframes alone. The frames are not part of the map and are discarded with the problem.
void AddFrames(std::span<const BundleFrame> frames, BundleProblem& problem) {
  for (const BundleFrame& frame : frames) {
    for (const BundleFrame::Match& match : frame.matches) {
      const auto point = std::ranges::lower_bound(problem.points, match.point, {}, &BundlePoint::id);
      if (point != problem.points.end() && point->id == match.point) {
        problem.observations.push_back({problem.poses.size(),
                                        static_cast<std::size_t>(point - problem.points.begin()), match.pixel,
                                        match.sigma, true, match.pixel, match.detected_sigma});
      }
    }
    problem.poses.push_back({kNoKeyframe, false, frame.T_camera_map});
  }
  std::ranges::stable_sort(problem.observations, {}, &BundleObservation::point);
}

BundleAdjustmentReport Run(Map& map, BundleProblem problem, const BundleSolverOptions& options,
                           const std::function<bool()>& interrupt, const JointObjects& objects) {
  AddObjects(objects.terms, objects.options, map, problem);
  BundleAdjustmentReport report;
  report.interrupted = !SolveBundle(problem, options, interrupt);
  ApplyBundle(problem, map);
  for (const BundleObject& object : problem.objects) {
    if (object.improved) {
      report.objects.emplace_back(object.id, object.superquadric);
    }
  }
  return report;
}

}  // namespace

BundleProblem ExtractBundleProblem(const Map& map, const Camera& camera, const std::vector<KeyframeId>& free,
                                   const std::vector<KeyframeId>& fixed) {
  BundleProblem problem{camera, {}, {}, {}};
  std::vector<PointId> points;
  for (const KeyframeId id : free) {
    problem.poses.push_back({id, false, map.At(id).T_camera_map});
    std::ranges::copy(map.At(id).SeenPoints(), std::back_inserter(points));
  }
  for (const KeyframeId id : fixed) {
    problem.poses.push_back({id, true, map.At(id).T_camera_map});
  }
  std::ranges::sort(problem.poses, {}, &BundlePose::id);
  std::ranges::sort(points);
  points.erase(std::unique(points.begin(), points.end()), points.end());
  for (const PointId id : points) {
    const MapPoint& point = map.Point(id);
    BundlePoint& added = problem.points.emplace_back(BundlePoint{id, point.p_map, 0, true});
    for (const Observation& o : point.observations) {
      const auto pose = std::ranges::lower_bound(problem.poses, o.keyframe, {}, &BundlePose::id);
      if (pose == problem.poses.end() || pose->id != o.keyframe) {
        ++added.seen_elsewhere;
        continue;
      }
      const Keypoint& keypoint = map.KeypointOf(o);
      problem.observations.push_back({static_cast<std::size_t>(pose - problem.poses.begin()),
                                      problem.points.size() - 1, keypoint.pixel, map.Levels().Sigma(keypoint),
                                      true, keypoint.raw_pixel, map.Levels().Scale(keypoint.octave)});
    }
  }
  return problem;
}

BundleProblem ExtractBundleProblem(const Map& map, const Camera& camera) {
  std::vector<KeyframeId> free = ToVector(map.Keyframes() | std::views::keys);
  if (free.empty()) {
    return {camera, {}, {}, {}};
  }
  const std::vector<KeyframeId> fixed{free.front()};
  free.erase(free.begin());
  return ExtractBundleProblem(map, camera, free, fixed);
}

void AddObjects(std::span<const ObjectTerm> objects, const JointObjectOptions& options, const Map& map,
                BundleProblem& problem) {
  constexpr double kShapeSigma = 0.1;  // radial distance of a point to the surface, mean half sizes
  for (const ObjectTerm& term : objects) {
    BundleObject object;
    object.id = term.id;
    object.superquadric = term.superquadric;
    object.sigma = kShapeSigma * term.superquadric.shape.half_size.mean();
    for (std::size_t i = 0; i < term.points.size(); ++i) {
      const PointId id = term.points[i];
      const auto it = std::ranges::lower_bound(problem.points, id, {}, &BundlePoint::id);
      if (it != problem.points.end() && it->id == id) {
        object.points.push_back({static_cast<std::size_t>(it - problem.points.begin()), term.weights[i]});
      } else {
        object.held_points.push_back({map.Point(id).p_map, term.weights[i]});
      }
    }
    if (static_cast<int>(object.points.size()) >= options.min_points) {
      problem.objects.push_back(std::move(object));
    }
  }
}

int ApplyBundle(const BundleProblem& problem, Map& map) {
  for (const BundlePose& pose : problem.poses) {
    if (!pose.fixed && map.HasKeyframe(pose.id)) {
      map.At(pose.id).T_camera_map = pose.T_camera_map;
    }
  }
  for (const BundlePoint& point : problem.points) {
    if (map.IsAlive(point.id)) {
      map.Point(point.id).p_map = point.p_map;
    }
  }
  int outliers = 0;
  for (const BundleObservation& o : problem.observations) {
    if (!o.inlier && problem.poses[o.pose].id != kNoKeyframe) {
      map.RemoveObservation(problem.points[o.point].id, problem.poses[o.pose].id);
      ++outliers;
    }
  }
  for (const BundlePoint& point : problem.points) {
    if (map.IsAlive(point.id)) {
      map.UpdateNormalAndRange(point.id);
    }
  }
  return outliers;
}

std::vector<KeyframeId> LocalWindow(const Map& map, KeyframeId center, int size) {
  std::vector<KeyframeId> window = map.At(center).BestCovisible(size - 1);
  window.push_back(center);
  return window;
}

BundleAdjustmentReport LocalBundleAdjustment(Map& map, const Camera& camera,
                                             const std::vector<KeyframeId>& window,
                                             const BundleAdjustmentOptions& options,
                                             const std::function<bool()>& interrupt,
                                             const JointObjects& objects) {
  constexpr int kMaxFixed = 20;  // keyframes outside of the window
  const std::set<KeyframeId> inside(window.begin(), window.end());
  std::vector<KeyframeId> free(inside.begin(), inside.end());
  std::map<KeyframeId, int> outside;  // keyframe -> observations of these points
  for (const KeyframeId id : free) {
    for (const PointId point : map.At(id).SeenPoints()) {
      for (const Observation& o : map.Point(point).observations) {
        if (!inside.contains(o.keyframe)) {
          ++outside[o.keyframe];
        }
      }
    }
  }
  auto ranked = ToVector(outside, [](const auto& seen) { return std::pair(seen.second, seen.first); });
  std::ranges::sort(ranked, std::greater<>());
  std::vector<KeyframeId> fixed = ToVector(ranked | std::views::take(kMaxFixed) | std::views::values);
  // The gauge (pose and scale) needs two fixed keyframes: the two oldest while the map is small.
  while (fixed.size() < 2 && free.size() > 1) {
    fixed.push_back(free.front());
    free.erase(free.begin());
  }
  return Run(map, ExtractBundleProblem(map, camera, free, fixed), options, interrupt, objects);
}

BundleAdjustmentReport GlobalBundleAdjustment(Map& map, const Camera& camera, int iterations,
                                              const JointObjects& objects,
                                              std::span<const BundleFrame> frames) {
  BundleProblem problem = ExtractBundleProblem(map, camera);
  AddFrames(frames, problem);
  return Run(map, std::move(problem), {iterations, iterations}, {}, objects);
}

}  // namespace sqslam
