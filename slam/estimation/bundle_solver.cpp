#include <ceres/ceres.h>
#include <ceres/normal_prior.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "slam/estimation/bundle_adjustment.h"
#include "slam/estimation/bundle_objects.h"
#include "slam/estimation/reprojection_cost.h"
#include "slam/estimation/reprojection_error.h"
#include "slam/util/to_vector.h"

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

// The parameter blocks of a problem. They are stored in vectors in the order of ids, because Ceres orders
// them by address: otherwise runs are not bit-reproducible.
class BundleSolver {
 public:
  // `held_focal`: log of the constant focal length, in units of the problem's; none: free.
  explicit BundleSolver(BundleProblem& bundle, std::optional<double> held_focal = std::nullopt)
      : bundle_(bundle), objects_(bundle), held_focal_(held_focal) {
    for (const BundlePose& pose : bundle.poses) {
      pose_blocks_.push_back(ToBlock(pose.T_camera_map));
    }
  }

  // Returns false if the solver was interrupted.
  bool Round(int iterations, bool robust, const std::function<bool()>& stop) {
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
    options.max_num_line_search_step_size_iterations = 0;  // steps are clamped to the bounds of the exponents
    const auto free = std::ranges::count(bundle_.poses, false, &BundlePose::fixed);
    options.linear_solver_type = free < 40 ? ceres::DENSE_SCHUR : ceres::SPARSE_SCHUR;
    options.max_num_iterations = iterations;
    options.num_threads = 1;
    options.function_tolerance = bundle_.learnt ? 1e-7 : 1e-5;  // the focal length converges last
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
      ApplyCamera();
    }
    cost_ = summary.final_cost;
    if (!held_focal_) {
      MarkOutliers();
    }
    return !interrupter.Interrupted();
  }

  double Cost() const { return cost_; }  // half the sum of squares of the last round, priors included

  void KeepObjectImprovements() { objects_.KeepImprovements(); }

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
    // The prior mean is the camera before the first round.
    const Eigen::Vector2d mean(-focal_change_, -bundle_.camera.distortion[0]);
    const Eigen::Vector2d factors(1.0 / learnt.focal_prior, 1.0 / learnt.radial_prior);
    problem.AddResidualBlock(new ceres::NormalPrior(factors.asDiagonal(), mean), nullptr,
                             camera_block_.data());
  }

  // Takes over the estimated camera and undistorts the observations with it.
  void ApplyCamera() {
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
    constexpr double kMinPointDepth = 1e-5;
    for (const BundleObservation& o : bundle_.observations) {
      BundlePoint& point = bundle_.points[o.point];
      double* const pose = pose_blocks_[o.pose].data();
      // Points behind the camera have no reprojection; MarkOutliers() rejects their observations.
      if (o.inlier && point.alive && (FromBlock(pose) * point.p_map).z() > kMinPointDepth) {
        const PixelMeasurement measured(bundle_.camera, o.pixel, o.sigma);
        if (bundle_.learnt) {
          problem.AddResidualBlock(new CameraReprojectionCost(measured), loss, pose, point.p_map.data(),
                                   camera_block_.data());
        } else {
          problem.AddResidualBlock(new ReprojectionCost(measured), loss, pose, point.p_map.data());
        }
      }
    }
  }

  void MarkOutliers() {
    std::vector<int> seen = ToVector(bundle_.points, &BundlePoint::seen_elsewhere);
    for (BundleObservation& o : bundle_.observations) {
      const BundlePoint& point = bundle_.points[o.point];
      if (!o.inlier || !point.alive) {
        continue;
      }
      o.inlier = SquaredError(bundle_.camera, bundle_.poses[o.pose].T_camera_map * point.p_map, o.pixel,
                              o.sigma * o.sigma) <= kChi2TwoDof;
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
  double focal_change_ = 0.0;  // change of the log focal length in earlier rounds
  double cost_ = 0.0;
};

}  // namespace

bool SolveBundle(BundleProblem& problem, const BundleSolverOptions& options,
                 const std::function<bool()>& stop) {
  BundleSolver solver(problem);
  const bool finished =
      solver.Round(options.iterations, true, stop) && solver.Round(options.final_iterations, false, stop);
  solver.KeepObjectImprovements();
  return finished;
}

double FocalDeviation(const BundleProblem& solved, int iterations) {
  constexpr double kStep = 0.02;  // of the logarithm: far above the convergence error of the solver
  const auto cost_at = [&](double step) {
    BundleProblem problem = solved;
    BundleSolver solver(problem, step);
    solver.Round(iterations, false, {});
    return solver.Cost();
  };
  const double at = cost_at(0.0);
  const double rise = 0.5 * (cost_at(kStep) + cost_at(-kStep)) - at;
  // The size of the residuals replaces the pixels' standard deviation, which is only known up to a factor.
  // The errors of a point are similar in most of its images, so all of them count as one.
  const auto alive = std::ranges::count(solved.points, true, &BundlePoint::alive);
  if (at <= 0.0 || rise <= 0.0 || alive == 0) {
    return std::numeric_limits<double>::infinity();
  }
  const double variance = at / static_cast<double>(alive);  // half the sum over two coordinates each
  return solved.camera.fx * kStep * std::sqrt(variance / (2.0 * rise));
}

}  // namespace sqslam
