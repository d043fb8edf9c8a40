#include "slam/estimation/bundle_problem.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "slam/estimation/bundle_objects.h"
#include "slam/estimation/reprojection_cost.h"
#include "slam/estimation/reprojection_error.h"

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
  // `held_focal`: the logarithm of the focal length, in units of the problem's, at which it is held; none:
  // free.
  explicit BundleSolver(BundleProblem& bundle, std::optional<double> held_focal = std::nullopt)
      : bundle_(bundle), objects_(bundle), held_focal_(held_focal) {
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
    if (bundle_.learnt) {
      AddCamera(problem, *options.linear_solver_ordering);
    }
    AddResiduals(problem, robust ? &huber : nullptr);
    objects_.AddTo(problem, *options.linear_solver_ordering);
    options.max_num_line_search_step_size_iterations = 0;  // the exponents' bounds are kept by clamping steps
    const auto free = std::count_if(bundle_.poses.begin(), bundle_.poses.end(),
                                    [](const BundlePose& pose) { return !pose.fixed; });
    options.linear_solver_type = free < 40 ? ceres::DENSE_SCHUR : ceres::SPARSE_SCHUR;
    options.max_num_iterations = iterations;
    options.num_threads = threads;
    options.function_tolerance = bundle_.learnt ? 1e-7 : 1e-5;  // the focal length is the last to settle
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
    if (bundle_.learnt) {
      TakeCamera();
    }
    cost_ = summary.final_cost;
    if (!held_focal_) {
      MarkOutliers();
    }
    return !interrupter.Interrupted();
  }

  double Cost() const { return cost_; }  // half the sum of squares of the last round, priors included

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

  void AddCamera(ceres::Problem& problem, ceres::ParameterBlockOrdering& ordering) {
    const BundleCamera& learnt = *bundle_.learnt;
    camera_block_ = {held_focal_.value_or(0.0), 0.0};
    problem.AddParameterBlock(camera_block_.data(), 2);
    ordering.AddElementToGroup(camera_block_.data(), 1);
    std::vector<int> held;
    if (held_focal_) {
      held.push_back(0);
    }
    if (!learnt.distortion) {
      held.push_back(1);
    }
    if (held.size() == camera_block_.size()) {
      problem.SetParameterBlockConstant(camera_block_.data());
    } else if (!held.empty()) {
      camera_manifold_.emplace(2, held);
      problem.SetManifold(camera_block_.data(), &*camera_manifold_);
    }
    // The prior is of the camera that the first round began with.
    problem.AddResidualBlock(new CameraPriorCost({-focal_change_, -bundle_.camera.distortion[0]},
                                                 {learnt.focal_prior, learnt.radial_prior}),
                             nullptr, camera_block_.data());
  }

  // The camera as it was found, and the observations undistorted as it would have them.
  void TakeCamera() {
    const auto [log_focal, radial] = camera_block_;
    Camera& camera = bundle_.camera;
    const double scale = std::exp(log_focal);
    focal_change_ += log_focal;
    camera.fx *= scale;
    camera.fy *= scale;
    double power = scale * scale;  // the same distortion in pixels
    for (const std::size_t i : {0, 1, 4}) {
      camera.distortion[i] *= power;
      power *= scale * scale;
    }
    camera.distortion[2] *= scale;
    camera.distortion[3] *= scale;
    camera.distortion[0] += radial;
    Camera added = camera;
    added.distortion = {radial};
    for (BundleObservation& o : bundle_.observations) {
      o.pixel = added.Undistort(o.pixel);
    }
  }

  void AddResiduals(ceres::Problem& problem, ceres::LossFunction* loss) {
    for (const BundleObservation& o : bundle_.observations) {
      BundlePoint& point = bundle_.points[o.point];
      // Behind the camera there is no reprojection; MarkOutliers() takes the observation away.
      if (o.inlier && point.alive && IsInFront(o.pose, point.p_map)) {
        double* const pose = pose_blocks_[o.pose].data();
        if (bundle_.learnt) {
          problem.AddResidualBlock(new CameraReprojectionCost(bundle_.camera, o.pixel, o.sigma), loss, pose,
                                   point.p_map.data(), camera_block_.data());
        } else {
          problem.AddResidualBlock(new ReprojectionCost(bundle_.camera, o.pixel, o.sigma), loss, pose,
                                   point.p_map.data());
        }
      }
    }
  }

  bool IsInFront(std::size_t pose, const Eigen::Vector3d& p_map) const {
    constexpr double kNearest = 1e-5;
    return (FromBlock(pose_blocks_[pose].data()) * p_map).z() > kNearest;
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
  std::optional<double> held_focal_;
  CameraBlock camera_block_{};
  std::optional<ceres::SubsetManifold> camera_manifold_;
  double focal_change_ = 0.0;  // of the logarithm, in the rounds before
  double cost_ = 0.0;
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

void AddObjects(std::span<const ObjectTerm> objects, const JointObjectOptions& options, const Map& map,
                BundleProblem& problem) {
  for (const ObjectTerm& term : objects) {
    BundleObject object;
    object.id = term.id;
    object.superquadric = term.superquadric;
    object.sigma = options.sigma * term.superquadric.shape.half_size.mean();
    object.huber = options.huber;
    object.prior = options.prior;
    for (std::size_t i = 0; i < term.points.size(); ++i) {
      const PointId id = term.points[i];
      const auto it = std::lower_bound(problem.points.begin(), problem.points.end(), id,
                                       [](const BundlePoint& a, PointId b) { return a.id < b; });
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

bool SolveBundle(BundleProblem& problem, const BundleSolverOptions& options,
                 const std::function<bool()>& stop) {
  BundleSolver solver(problem);
  const bool finished = solver.Round(options.iterations, true, options.threads, stop) &&
                        solver.Round(options.final_iterations, false, options.threads, stop);
  solver.JudgeObjects();
  return finished;
}

double FocalDeviation(const BundleProblem& solved, int iterations, const std::function<bool()>& stop) {
  constexpr double kStep = 0.02;  // of the logarithm: far beyond what the solver leaves undone
  const auto cost_at = [&](double step) {
    BundleProblem problem = solved;
    BundleSolver solver(problem, step);
    const bool finished = solver.Round(iterations, false, 1, stop);
    return finished ? solver.Cost() : 0.0;
  };
  const double at = cost_at(0.0);
  const double rise = 0.5 * (cost_at(kStep) + cost_at(-kStep)) - at;
  // The errors' own size stands in for the pixels' standard deviation, which is only known up to a factor. A
  // point is seen a little off its place in the same way in most of its images: all its errors count as one.
  const auto alive = std::count_if(solved.points.begin(), solved.points.end(),
                                   [](const BundlePoint& point) { return point.alive; });
  if (at <= 0.0 || rise <= 0.0 || alive == 0) {
    return std::numeric_limits<double>::infinity();
  }
  const double variance = at / static_cast<double>(alive);  // half the sum over two coordinates each
  return solved.camera.fx * kStep * std::sqrt(variance / (2.0 * rise));
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
