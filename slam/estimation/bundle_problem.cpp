#include "slam/estimation/bundle_problem.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "slam/estimation/object_blocks.h"
#include "slam/estimation/pose_optimization.h"
#include "slam/estimation/reprojection_cost.h"

namespace sqslam {
namespace {

class Interrupter final : public ceres::IterationCallback {
 public:
  explicit Interrupter(const std::function<bool()>& stop) : stop_(stop) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary&) override {
    interrupted_ = interrupted_ || (stop_ && stop_());
    return interrupted_ ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }
  bool Interrupted() const { return interrupted_; }

 private:
  const std::function<bool()>& stop_;
  bool interrupted_ = false;
};

// The parameter blocks of a problem. They lie in vectors, in the order of ids, because Ceres orders them by
// address: only so are two runs bit-identical.
class BundleSolver {
 public:
  explicit BundleSolver(BundleProblem& bundle) : bundle_(bundle), objects_(bundle) {
    for (const BundlePose& pose : bundle.poses) {
      pose_blocks_.push_back(ToBlock(pose.T_camera_map));
    }
  }

  // Returns false where the solver was interrupted.
  bool Round(int iterations, bool robust, int threads, const std::function<bool()>& stop) {
    ceres::Problem::Options problem_options;
    problem_options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    problem_options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    ceres::HuberLoss huber(std::sqrt(kChi2TwoDof));
    PoseManifold manifold;
    ceres::Problem problem(problem_options);
    ceres::Solver::Options options;
    options.linear_solver_ordering = AddParameterBlocks(problem, manifold);
    AddResiduals(problem, robust ? &huber : nullptr);
    objects_.AddTo(problem, *options.linear_solver_ordering);
    options.max_num_line_search_step_size_iterations = 0;  // the exponents' bounds are kept by clamping steps
    const auto free = std::count_if(bundle_.poses.begin(), bundle_.poses.end(),
                                    [](const BundlePose& pose) { return !pose.fixed; });
    options.linear_solver_type = free < 40 ? ceres::DENSE_SCHUR : ceres::SPARSE_SCHUR;
    options.max_num_iterations = iterations;
    options.num_threads = threads;
    options.function_tolerance = 1e-5;
    options.logging_type = ceres::SILENT;
    Interrupter interrupter(stop);
    options.callbacks.push_back(&interrupter);
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    for (std::size_t i = 0; i < pose_blocks_.size(); ++i) {
      if (!bundle_.poses[i].fixed) {
        bundle_.poses[i].T_camera_map = FromBlock(pose_blocks_[i].data());
      }
    }
    objects_.Read();
    MarkOutliers();
    return !interrupter.Interrupted();
  }

  void JudgeObjects() { objects_.Judge(); }

 private:
  std::shared_ptr<ceres::ParameterBlockOrdering> AddParameterBlocks(ceres::Problem& problem,
                                                                    PoseManifold& manifold) {
    auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
    for (std::size_t i = 0; i < pose_blocks_.size(); ++i) {
      double* block = pose_blocks_[i].data();
      problem.AddParameterBlock(block, 7, &manifold);
      ordering->AddElementToGroup(block, 1);
      if (bundle_.poses[i].fixed) {
        problem.SetParameterBlockConstant(block);
      }
    }
    for (BundlePoint& point : bundle_.points) {
      if (point.alive) {
        problem.AddParameterBlock(point.p_map.data(), 3);
        ordering->AddElementToGroup(point.p_map.data(), 0);
      }
    }
    return ordering;
  }

  void AddResiduals(ceres::Problem& problem, ceres::LossFunction* loss) {
    for (const BundleObservation& o : bundle_.observations) {
      BundlePoint& point = bundle_.points[o.point];
      // Behind the camera there is no reprojection; MarkOutliers() takes the observation away.
      if (o.inlier && point.alive && IsInFront(o.pose, point.p_map)) {
        problem.AddResidualBlock(new ReprojectionCost(bundle_.camera, o.pixel, o.sigma), loss,
                                 pose_blocks_[o.pose].data(), point.p_map.data());
      }
    }
  }

  bool IsInFront(std::size_t pose, const Eigen::Vector3d& p_map) const {
    constexpr double kMinDepth = 1e-5;
    return (FromBlock(pose_blocks_[pose].data()) * p_map).z() > kMinDepth;
  }

  void MarkOutliers() {
    std::vector<int> seen;
    for (const BundlePoint& point : bundle_.points) {
      seen.push_back(point.seen_elsewhere);
    }
    for (BundleObservation& o : bundle_.observations) {
      const BundlePoint& point = bundle_.points[o.point];
      if (!o.inlier || !point.alive) {
        continue;
      }
      const Eigen::Vector3d p_camera = bundle_.poses[o.pose].T_camera_map * point.p_map;
      o.inlier = p_camera.z() > 0.0 && (bundle_.camera.Project(p_camera) - o.pixel).squaredNorm() <=
                                           kChi2TwoDof * (o.sigma * o.sigma);
      seen[o.point] += o.inlier ? 1 : 0;
    }
    for (std::size_t i = 0; i < seen.size(); ++i) {
      bundle_.points[i].alive = bundle_.points[i].alive && seen[i] >= 2;
    }
  }

  BundleProblem& bundle_;
  std::vector<PoseBlock> pose_blocks_;
  ObjectBlocks objects_;
};

}  // namespace

BundleProblem ExtractBundleProblem(const Map& map, const Camera& camera, const std::vector<KeyframeId>& free,
                                   const std::vector<KeyframeId>& fixed) {
  BundleProblem problem{camera, {}, {}, {}};
  std::vector<PointId> points;
  for (const KeyframeId id : free) {
    problem.poses.push_back({id, false, map.At(id).T_camera_map});
    for (const PointId point : map.At(id).points) {
      if (point != kNoPoint) {
        points.push_back(point);
      }
    }
  }
  for (const KeyframeId id : fixed) {
    problem.poses.push_back({id, true, map.At(id).T_camera_map});
  }
  std::sort(problem.poses.begin(), problem.poses.end(),
            [](const BundlePose& a, const BundlePose& b) { return a.id < b.id; });
  std::sort(points.begin(), points.end());
  points.erase(std::unique(points.begin(), points.end()), points.end());
  for (const PointId id : points) {
    const MapPoint& point = map.Point(id);
    BundlePoint& added = problem.points.emplace_back(BundlePoint{id, point.p_map, 0, true});
    for (const Observation& o : point.observations) {
      const auto pose = std::lower_bound(problem.poses.begin(), problem.poses.end(), o.keyframe,
                                         [](const BundlePose& a, KeyframeId b) { return a.id < b; });
      if (pose == problem.poses.end() || pose->id != o.keyframe) {
        ++added.seen_elsewhere;
        continue;
      }
      const Keypoint& keypoint = map.At(o.keyframe).features->keypoints[static_cast<std::size_t>(o.keypoint)];
      problem.observations.push_back({static_cast<std::size_t>(pose - problem.poses.begin()),
                                      problem.points.size() - 1, keypoint.pixel,
                                      map.Levels().Scale(keypoint.octave), true});
    }
  }
  return problem;
}

BundleProblem ExtractBundleProblem(const Map& map, const Camera& camera) {
  std::vector<KeyframeId> free;
  for (const auto& [id, keyframe] : map.Keyframes()) {
    free.push_back(id);
  }
  if (free.empty()) {
    return {camera, {}, {}, {}};
  }
  const std::vector<KeyframeId> fixed{free.front()};
  free.erase(free.begin());
  return ExtractBundleProblem(map, camera, free, fixed);
}

bool SolveBundle(BundleProblem& problem, const BundleSolverOptions& options,
                 const std::function<bool()>& stop) {
  BundleSolver solver(problem);
  const bool finished = solver.Round(options.iterations, true, options.threads, stop) &&
                        solver.Round(options.final_iterations, false, options.threads, stop);
  solver.JudgeObjects();
  return finished;
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
    if (!o.inlier) {
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

}  // namespace sqslam
