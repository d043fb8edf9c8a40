#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>
#include <deque>
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
  explicit BundleSolver(BundleProblem& bundle) : bundle_(bundle), objects_(bundle) {
    for (const BundlePose& pose : bundle.poses) {
      pose_blocks_.push_back(ToBlock(pose.T_camera_map));
    }
  }

  // Returns false if the solver was interrupted.
  bool Round(int iterations, double cost_tolerance, bool robust, const std::function<bool()>& stop) {
    ceres::Problem::Options problem_options;
    problem_options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;  // it would keep a tree of them
    problem_options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    problem_options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    problem_options.disable_all_safety_checks = true;
    ceres::HuberLoss huber(std::sqrt(kChi2TwoDof));
    PoseManifold manifold;
    ceres::Problem problem(problem_options);
    ceres::Solver::Options options;
    options.linear_solver_ordering = AddParameterBlocks(problem, manifold);
    AddResiduals(problem, huber, robust);
    objects_.AddTo(problem, *options.linear_solver_ordering);
    const auto object_costs = OwnCostsOfObjects(problem);
    options.max_num_line_search_step_size_iterations = 0;  // steps are clamped to the bounds of the exponents
    const auto free = std::ranges::count(bundle_.poses, false, &BundlePose::fixed);
    options.linear_solver_type = free < 40 ? ceres::DENSE_SCHUR : ceres::SPARSE_SCHUR;
    options.max_num_iterations = iterations;
    options.num_threads = 1;
    options.function_tolerance = cost_tolerance;
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

  // `robust`: all of them; otherwise only those that may be off by more than their sigma tells.
  void AddResiduals(ceres::Problem& problem, ceres::LossFunction& loss, bool robust) {
    constexpr double kMinPointDepth = 1e-5;
    costs_.clear();
    for (const BundleObservation& o : bundle_.observations) {
      BundlePoint& point = bundle_.points[o.point];
      double* const pose = pose_blocks_[o.pose].data();
      // Points behind the camera have no reprojection; MarkOutliers() rejects their observations.
      if (o.inlier && point.alive && (FromBlock(pose) * point.p_map).z() > kMinPointDepth) {
        const PixelMeasurement measured(bundle_.camera, o.pixel, o.sigma);
        problem.AddResidualBlock(&costs_.emplace_back(measured),
                                 robust || o.sigma < o.detected_sigma ? &loss : nullptr, pose,
                                 point.p_map.data());
      }
    }
  }

  // Returns what ObjectBlocks has added after the reprojection errors.
  std::vector<std::unique_ptr<const ceres::CostFunction>> OwnCostsOfObjects(
      const ceres::Problem& problem) const {
    std::vector<ceres::ResidualBlockId> blocks;
    problem.GetResidualBlocks(&blocks);
    std::vector<std::unique_ptr<const ceres::CostFunction>> costs;
    for (std::size_t i = costs_.size(); i < blocks.size(); ++i) {
      costs.emplace_back(problem.GetCostFunctionForResidualBlock(blocks[i]));
    }
    return costs;
  }

  void MarkOutliers() {
    std::vector<int> seen = ToVector(bundle_.points, &BundlePoint::seen_elsewhere);
    for (BundleObservation& o : bundle_.observations) {
      const BundlePoint& point = bundle_.points[o.point];
      if (!o.inlier || !point.alive) {
        continue;
      }
      o.inlier = SquaredError(bundle_.camera, bundle_.poses[o.pose].T_camera_map * point.p_map, o.pixel,
                              o.detected_sigma * o.detected_sigma) <= kChi2TwoDof;
      seen[o.point] += o.inlier ? 1 : 0;
    }
    for (std::size_t i = 0; i < seen.size(); ++i) {
      bundle_.points[i].alive = bundle_.points[i].alive && seen[i] >= 2;
    }
  }

  BundleProblem& bundle_;
  std::vector<PoseBlock> pose_blocks_;
  std::deque<ReprojectionCost> costs_;  // of the current round, at constant addresses
  ObjectBlocks objects_;
};

}  // namespace

bool SolveBundle(BundleProblem& problem, const BundleSolverOptions& options,
                 const std::function<bool()>& stop) {
  BundleSolver solver(problem);
  const bool finished = solver.Round(options.iterations, options.cost_tolerance, true, stop) &&
                        solver.Round(options.final_iterations, options.cost_tolerance, false, stop);
  solver.KeepObjectImprovements();
  return finished;
}

}  // namespace sqslam
