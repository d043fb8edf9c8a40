#include "slam/estimation/bundle_adjustment.h"

#include <algorithm>
#include <map>
#include <set>

namespace sqslam {
namespace {

BundleAdjustmentReport Run(Map& map, BundleProblem problem, const BundleSolverOptions& options,
                           const std::function<bool()>& interrupt, const JointObjects& objects) {
  AddObjects(objects.terms, objects.options, map, problem);
  BundleAdjustmentReport report;
  for (const BundlePose& pose : problem.poses) {
    ++(pose.fixed ? report.fixed_keyframes : report.keyframes);
  }
  report.points = static_cast<int>(problem.points.size());
  report.observations = static_cast<int>(problem.observations.size());
  report.interrupted = !SolveBundle(problem, options, interrupt);
  report.outliers = ApplyBundle(problem, map);
  for (const BundleObject& object : problem.objects) {
    if (object.improved) {
      report.objects.emplace_back(object.id, object.superquadric);
    }
  }
  return report;
}

}  // namespace

BundleAdjustmentReport LocalBundleAdjustment(Map& map, const Camera& camera, KeyframeId center,
                                             const BundleAdjustmentOptions& options,
                                             const std::function<bool()>& interrupt,
                                             const JointObjects& objects) {
  std::vector<KeyframeId> free = map.At(center).BestCovisible(options.max_keyframes - 1);
  free.push_back(center);
  std::set<KeyframeId> inside(free.begin(), free.end());
  std::map<KeyframeId, int> outside;  // keyframe -> observations of the points in question
  for (const KeyframeId id : free) {
    for (const PointId point : map.At(id).points) {
      if (point != kNoPoint) {
        for (const Observation& o : map.Point(point).observations) {
          if (!inside.contains(o.keyframe)) {
            ++outside[o.keyframe];
          }
        }
      }
    }
  }
  std::vector<std::pair<int, KeyframeId>> ranked;
  for (const auto& [id, count] : outside) {
    ranked.emplace_back(count, id);
  }
  std::sort(ranked.begin(), ranked.end(), std::greater<>());
  std::vector<KeyframeId> fixed;
  for (const auto& [count, id] : ranked) {
    if (static_cast<int>(fixed.size()) < options.max_fixed) {
      fixed.push_back(id);
    }
  }
  // The gauge (pose and scale) needs two fixed keyframes: while the map is small, its two oldest.
  std::sort(free.begin(), free.end());
  while (fixed.size() < 2 && free.size() > 1) {
    fixed.push_back(free.front());
    free.erase(free.begin());
  }
  return Run(map, ExtractBundleProblem(map, camera, free, fixed),
             {options.iterations, options.final_iterations, options.threads}, interrupt, objects);
}

BundleAdjustmentReport GlobalBundleAdjustment(Map& map, const Camera& camera, int iterations,
                                              const BundleAdjustmentOptions& options,
                                              const JointObjects& objects) {
  return Run(map, ExtractBundleProblem(map, camera), {iterations, iterations, options.threads}, {}, objects);
}

LearntCamera LearnCamera(Map& map, const Camera& camera, const CameraLearningOptions& options, int threads) {
  BundleProblem problem = ExtractBundleProblem(map, camera);
  problem.learnt = BundleCamera{.distortion = options.what == LearntPart::kFocalAndRadial};
  SolveBundle(problem, {options.iterations, options.iterations, threads}, {});
  LearntCamera learnt{camera, problem.camera.fx, FocalDeviation(problem, options.iterations, {}), false};
  learnt.trusted = learnt.focal_deviation <= options.max_deviation * learnt.focal;
  if (learnt.trusted) {
    ApplyBundle(problem, map);
    learnt.camera = problem.camera;
  }
  return learnt;
}

}  // namespace sqslam
