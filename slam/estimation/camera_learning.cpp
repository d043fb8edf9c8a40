#include "slam/estimation/camera_learning.h"

#include <ceres/ceres.h>
#include <ceres/normal_prior.h>

#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <numeric>
#include <optional>
#include <ranges>
#include <tuple>
#include <utility>
#include <vector>

#include "slam/estimation/bundle_adjustment.h"
#include "slam/estimation/reprojection_cost.h"
#include "slam/estimation/reprojection_error.h"
#include "slam/util/statistics.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

constexpr int kSolverSteps = 30;  // solver steps of a round
constexpr int kUnknowns = std::tuple_size_v<CameraBlock>;

// Means and standard deviations of what is unknown of a camera. The focal length gets its prior later
// (CombineEstimates); here it only stays finite without evidence.
struct CameraPrior {
  explicit CameraPrior(const Camera& camera)
      : deviations{1.0, 0.15, 0.05, 0.01 * camera.width, 0.01 * camera.width, 0.01},
        mean{0.0, 0.0, 0.0, 0.0, 0.0, 1e-3 * camera.readout_ms} {}

  CameraBlock deviations;
  CameraBlock mean;
};

// Orders the poses of a problem by time.
std::vector<std::size_t> ByTime(const BundleProblem& bundle, const Map& map) {
  std::vector<std::size_t> order(bundle.poses.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {},
                           [&](std::size_t pose) { return map.At(bundle.poses[pose].id).timestamp; });
  return order;
}

// Leaves every n-th point, and its observations, of a problem with more than a long run needs: from there on
// the error of the camera model is larger than that of the points.
void LimitPoints(BundleProblem& bundle) {
  constexpr std::size_t kMaxObservations = 40000;
  const std::size_t step = (bundle.observations.size() + kMaxObservations - 1) / kMaxObservations;
  for (std::size_t i = 0; i < bundle.points.size(); ++i) {
    bundle.points[i].alive = step <= 1 || i % step == 0;
  }
  std::erase_if(bundle.observations,
                [&](const BundleObservation& o) { return !bundle.points[o.point].alive; });
}

// Returns by how much a row's delay moves each observed point in the image, px per second of readout, from
// the poses of the keyframes before and after; zero where these are far apart in time.
std::vector<Eigen::Vector2d> Drifts(const BundleProblem& bundle, const Map& map,
                                    const std::vector<std::size_t>& by_time) {
  constexpr double kMaxInterval = 2.0;  // s, between the keyframe before and the one after
  std::vector<std::pair<std::size_t, std::size_t>> around(bundle.poses.size());
  for (std::size_t i = 0; i < by_time.size(); ++i) {
    around[by_time[i]] = {by_time[i > 0 ? i - 1 : 0], by_time[std::min(i + 1, by_time.size() - 1)]};
  }
  return ToVector(bundle.observations, [&](const BundleObservation& o) -> Eigen::Vector2d {
    const auto& [before, after] = around[o.pose];
    const double interval =
        map.At(bundle.poses[after].id).timestamp - map.At(bundle.poses[before].id).timestamp;
    const Eigen::Vector3d& p_map = bundle.points[o.point].p_map;
    const Eigen::Vector3d p_before = bundle.poses[before].T_camera_map * p_map;
    const Eigen::Vector3d p_after = bundle.poses[after].T_camera_map * p_map;
    if (interval <= 0.0 || interval > kMaxInterval || p_before.z() < kMinDepth || p_after.z() < kMinDepth) {
      return Eigen::Vector2d::Zero();
    }
    const double delay = (o.raw_pixel.y() + 0.5) / bundle.camera.height - 0.5;  // in readout times
    return delay / interval *
           (bundle.camera.ProjectDistorted(p_after) - bundle.camera.ProjectDistorted(p_before));
  });
}

// Collects how fast the errors of a solved problem change with the log focal length while everything else is
// optimised again, and derives its deviation: the variance of the sum of slope times error, over the square
// of the sum of squared slopes (Huber's sandwich, P. J. Huber, "The Behavior of Maximum Likelihood Estimates
// under Nonstandard Conditions", 1967). Errors of one point are alike in most images, and so are those of
// images close in time. So the variance is the largest of three: with independent errors, with independent
// points, and with independent spans of time.
class ErrorSlopes {
 public:
  static constexpr std::size_t kTimes = 8;  // spans of time

  // `slope`: of a prior's error, whose standard deviation is 1.
  void AddPrior(double slope) { prior_ += slope * slope; }

  void Add(const Eigen::Vector2d& error, const Eigen::Vector2d& slope, std::size_t point, std::size_t time) {
    squared_slopes_ += slope.squaredNorm();
    squared_errors_ += error.squaredNorm();
    by_point_[point] += slope.dot(error);
    by_time_[time] += slope.dot(error);
    ++count_;
  }

  double Deviation() const {
    // Every point has three unknowns, and with two images four equations.
    const double free = 2.0 * count_ - 3.0 * static_cast<double>(by_point_.size());
    const double independent = free > 0.0 ? squared_slopes_ * squared_errors_ / free : 0.0;
    const double points = SumOfSquares(by_point_ | std::views::values);
    const double times = SumOfSquares(by_time_) * FewSpansFactor();
    return std::sqrt(std::max({independent, points, times}) + prior_) / (squared_slopes_ + prior_);
  }

 private:
  // Returns by how much few spans of time underestimate a variance: a 95 % interval takes Student's t, with
  // one degree of freedom less than there are spans (A. C. Cameron and D. L. Miller, "A Practitioner's Guide
  // to Cluster-Robust Inference", 2015, section VI).
  double FewSpansFactor() const {
    const auto spans =
        static_cast<double>(std::ranges::count_if(by_time_, [](double d) { return d != 0.0; }));
    if (spans < 2.0) {
      return 1.0;
    }
    constexpr double kTail = 0.025;
    const double wider = quantile(complement(boost::math::students_t(spans - 1.0), kTail)) /
                         quantile(complement(boost::math::normal(), kTail));
    return wider * wider * spans / (spans - 1.0);
  }

  static double SumOfSquares(auto&& values) {
    double sum = 0.0;
    for (const double value : values) {
      sum += value * value;
    }
    return sum;
  }

  double prior_ = 0.0;
  double squared_slopes_ = 0.0;
  double squared_errors_ = 0.0;
  double count_ = 0.0;
  std::map<std::size_t, double> by_point_;
  std::array<double, kTimes> by_time_{};
};

using Errors = std::vector<Eigen::Vector2d>;  // by observation, in standard deviations; zero for outliers

// A bundle adjustment with an unknown camera.
class LearningProblem {
 public:
  LearningProblem(const Map& map, const Camera& camera)
      : bundle_(ExtractBundleProblem(map, camera)),
        prior_(camera),
        camera_{0.0, camera.distortion[0], camera.distortion[1], 0.0, 0.0, 1e-3 * camera.readout_ms} {
    LimitPoints(bundle_);
    const std::vector<std::size_t> by_time = ByTime(bundle_, map);
    drifts_ = Drifts(bundle_, map, by_time);
    ranks_.resize(by_time.size());
    for (std::size_t i = 0; i < by_time.size(); ++i) {
      ranks_[by_time[i]] = i;
    }
  }

  // Minimises all errors and rejects outliers.
  void Solve();

  // Returns the first (0) or the second half in time of a solved problem, solved again. They share no image.
  LearningProblem Half(std::size_t half) const;

  // Returns the estimate of a solved problem for the focal length over the assumed one.
  FocalEstimate Focal() const;

  // Returns the mean over all observations of a solved problem, each limited.
  double MeanSquaredError() const;

  // Returns the i-th coefficient of the lens, from 1.
  double Coefficient(std::size_t i) const { return camera_[i]; }

 private:
  // The solution of a problem whose focal length is held.
  struct HeldSolution {
    CameraBlock camera;
    Errors errors;
  };

  bool IsUsed(const BundleObservation& o) const { return o.inlier && bundle_.points[o.point].alive; }
  HeldSolution SolveAt(double log_focal) const;
  void Round(bool robust, bool hold_focal = false);
  void AddErrors(ceres::Problem& problem, ceres::ParameterBlockOrdering& ordering,
                 std::vector<PoseBlock>& poses, ceres::LossFunction* loss);
  void AddCamera(ceres::Problem& problem, ceres::ParameterBlockOrdering& ordering, ceres::Manifold* manifold);
  std::optional<Eigen::Vector2d> ErrorOf(std::size_t observation) const;
  Errors CurrentErrors() const;
  void RejectOutliers(double max_squared_error);

  BundleProblem bundle_;
  CameraPrior prior_;
  std::vector<Eigen::Vector2d> drifts_;  // by observation
  std::vector<std::size_t> ranks_;       // of the poses in time
  CameraBlock camera_;
};

void LearningProblem::AddErrors(ceres::Problem& problem, ceres::ParameterBlockOrdering& ordering,
                                std::vector<PoseBlock>& poses, ceres::LossFunction* loss) {
  for (std::size_t i = 0; i < bundle_.observations.size(); ++i) {
    const BundleObservation& o = bundle_.observations[i];
    Eigen::Vector3d& p_map = bundle_.points[o.point].p_map;
    if (IsUsed(o) && (bundle_.poses[o.pose].T_camera_map * p_map).z() > kMinDepth) {
      problem.AddResidualBlock(new CameraReprojectionCost(bundle_.camera, o.raw_pixel, o.sigma, drifts_[i]),
                               loss, poses[o.pose].data(), p_map.data(), camera_.data());
      ordering.AddElementToGroup(p_map.data(), 0);
      ordering.AddElementToGroup(poses[o.pose].data(), 1);
    }
  }
}

// `manifold`: of the part that is free; null: all.
void LearningProblem::AddCamera(ceres::Problem& problem, ceres::ParameterBlockOrdering& ordering,
                                ceres::Manifold* manifold) {
  problem.AddParameterBlock(camera_.data(), kUnknowns, manifold);
  ordering.AddElementToGroup(camera_.data(), 1);
  const Eigen::VectorXd deviations = Eigen::Map<const Eigen::VectorXd>(prior_.deviations.data(), kUnknowns);
  problem.AddResidualBlock(
      new ceres::NormalPrior(deviations.cwiseInverse().asDiagonal().toDenseMatrix(),
                             Eigen::Map<const Eigen::VectorXd>(prior_.mean.data(), kUnknowns)),
      nullptr, camera_.data());
}

void LearningProblem::Round(bool robust, bool hold_focal) {
  ceres::Problem::Options ownership;
  ownership.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ownership.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::HuberLoss huber(std::sqrt(kChi2TwoDof));
  PoseManifold pose_manifold;
  ceres::SubsetManifold all_but_focal(kUnknowns, {0});
  ceres::Problem problem(ownership);
  ceres::Solver::Options options;
  options.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  std::vector<PoseBlock> poses =
      ToVector(bundle_.poses, [](const BundlePose& pose) { return ToBlock(pose.T_camera_map); });
  AddCamera(problem, *options.linear_solver_ordering, hold_focal ? &all_but_focal : nullptr);
  AddErrors(problem, *options.linear_solver_ordering, poses, robust ? &huber : nullptr);
  bool fixed = false;  // the first pose that is seen: the map may lie anywhere
  for (PoseBlock& pose : poses) {
    if (problem.HasParameterBlock(pose.data())) {
      problem.SetManifold(pose.data(), &pose_manifold);
      if (!std::exchange(fixed, true)) {
        problem.SetParameterBlockConstant(pose.data());
      }
    }
  }
  options.linear_solver_type = poses.size() < 40 ? ceres::DENSE_SCHUR : ceres::SPARSE_SCHUR;
  options.max_num_iterations = kSolverSteps;
  options.num_threads = 1;
  options.function_tolerance = 1e-7;  // the focal length converges last
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    bundle_.poses[i].T_camera_map = FromBlock(poses[i].data());
  }
}

// In standard deviations; empty behind the camera.
std::optional<Eigen::Vector2d> LearningProblem::ErrorOf(std::size_t observation) const {
  const BundleObservation& o = bundle_.observations[observation];
  const PoseBlock pose = ToBlock(bundle_.poses[o.pose].T_camera_map);
  const std::array parameters = {pose.data(), bundle_.points[o.point].p_map.data(), camera_.data()};
  const CameraReprojectionCost cost(bundle_.camera, o.raw_pixel, o.sigma, drifts_[observation]);
  Eigen::Vector2d error;
  return cost.Evaluate(parameters.data(), error.data(), nullptr) ? std::optional(error) : std::nullopt;
}

Errors LearningProblem::CurrentErrors() const {
  Errors errors(bundle_.observations.size(), Eigen::Vector2d::Zero());
  for (std::size_t i = 0; i < errors.size(); ++i) {
    if (IsUsed(bundle_.observations[i])) {
      errors[i] = ErrorOf(i).value_or(Eigen::Vector2d::Zero());
    }
  }
  return errors;
}

void LearningProblem::RejectOutliers(double max_squared_error) {
  const Errors errors = CurrentErrors();
  std::vector<int> seen(bundle_.points.size(), 0);
  for (std::size_t i = 0; i < errors.size(); ++i) {
    BundleObservation& o = bundle_.observations[i];
    const bool in_front =
        (bundle_.poses[o.pose].T_camera_map * bundle_.points[o.point].p_map).z() > kMinDepth;
    o.inlier = IsUsed(o) && in_front && errors[i].squaredNorm() <= max_squared_error;
    seen[o.point] += o.inlier ? 1 : 0;
  }
  for (std::size_t i = 0; i < seen.size(); ++i) {
    bundle_.points[i].alive = seen[i] >= 2;
  }
}

void LearningProblem::Solve() {
  Round(true);
  RejectOutliers(kChi2TwoDof);
  Round(false);
  // Corners are more exact than a pixel of their level: the second rejection goes by the errors found.
  constexpr double kMedianOfChi2 = 1.386;  // two degrees of freedom
  std::vector<double> squared;
  const Errors errors = CurrentErrors();
  for (std::size_t i = 0; i < errors.size(); ++i) {
    if (IsUsed(bundle_.observations[i])) {
      squared.push_back(errors[i].squaredNorm());
    }
  }
  if (!squared.empty()) {
    RejectOutliers(kChi2TwoDof99 * UpperMedian(std::move(squared)) / kMedianOfChi2);
    Round(false);
  }
}

LearningProblem LearningProblem::Half(std::size_t half) const {
  LearningProblem part = *this;
  for (BundleObservation& o : part.bundle_.observations) {
    o.inlier = o.inlier && 2 * ranks_[o.pose] / ranks_.size() == half;
  }
  part.RejectOutliers(std::numeric_limits<double>::infinity());  // points that only one image shows
  part.Round(false);
  return part;
}

LearningProblem::HeldSolution LearningProblem::SolveAt(double log_focal) const {
  LearningProblem held = *this;
  held.camera_[0] = log_focal;
  held.Round(false, true);
  return {held.camera_, held.CurrentErrors()};
}

double LearningProblem::MeanSquaredError() const {
  double sum = 0.0;
  for (std::size_t i = 0; i < bundle_.observations.size(); ++i) {
    const std::optional<Eigen::Vector2d> error = ErrorOf(i);
    sum += error ? std::min(error->squaredNorm(), kChi2TwoDof) : kChi2TwoDof;
  }
  return sum / std::max(1.0, static_cast<double>(bundle_.observations.size()));
}

FocalEstimate LearningProblem::Focal() const {
  constexpr double kStep = 0.01;  // of the log focal length: far above the convergence error of the solver
  const HeldSolution longer = SolveAt(camera_[0] + kStep);
  const HeldSolution shorter = SolveAt(camera_[0] - kStep);
  ErrorSlopes slopes;
  for (std::size_t i = 0; i < camera_.size(); ++i) {
    slopes.AddPrior((longer.camera[i] - shorter.camera[i]) / (2.0 * kStep) / prior_.deviations[i]);
  }
  const Errors errors = CurrentErrors();
  for (std::size_t i = 0; i < errors.size(); ++i) {
    const BundleObservation& o = bundle_.observations[i];
    if (IsUsed(o)) {
      slopes.Add(errors[i], (longer.errors[i] - shorter.errors[i]) / (2.0 * kStep), o.point,
                 ranks_[o.pose] * ErrorSlopes::kTimes / ranks_.size());
    }
  }
  return {camera_[0], slopes.Deviation()};
}

}  // namespace

FocalEstimate CombineEstimates(const FocalEstimate& whole, const std::array<FocalEstimate, 2>& halves,
                               const FocalEstimate& prior) {
  // Deviation of the images from any camera of one focal length and k1: focus, the shape of pixels, further
  // terms of the lens. On two of seven calibrated sequences the images say 1.1 % more and 1.3 % less than the
  // calibration, in both halves alike. That is 0.65 % in the mean square of the seven, and 0.8 % for so few.
  constexpr double kModelDeviation = 0.008;
  // Share of a change that may be missing: matches that agree with the assumed camera are found more easily.
  constexpr double kMissingShare = 0.2;
  const double expected = std::hypot(halves[0].deviation, halves[1].deviation);
  const double disagreement = std::abs(halves[0].log_change - halves[1].log_change);
  const double birge_ratio = std::max(1.0, disagreement / expected);
  const double deviation =
      std::hypot(birge_ratio * whole.deviation, kModelDeviation, kMissingShare * whole.log_change);
  const double weight = 1.0 / (deviation * deviation);
  const double prior_weight = 1.0 / (prior.deviation * prior.deviation);
  return {(weight * whole.log_change + prior_weight * prior.log_change) / (weight + prior_weight),
          1.0 / std::sqrt(weight + prior_weight)};
}

std::array<double, 2> FocalInterval(double focal, double deviation) {
  constexpr double kQuantile = 1.96;  // 95 % of a normal distribution, two-sided
  return {focal * std::exp(-kQuantile * deviation), focal * std::exp(kQuantile * deviation)};
}

LearntCamera LearnCamera(Map& map, const Camera& camera, const CameraLearningOptions& options) {
  LearningProblem problem(map, camera);
  problem.Solve();
  const std::array halves = {problem.Half(0).Focal(), problem.Half(1).Focal()};
  const double known = options.prior.focal > 0.0 ? options.prior.focal : camera.fx;
  const FocalEstimate estimate =
      CombineEstimates(problem.Focal(), halves, {std::log(known / camera.fx), options.prior.deviation});
  const double scale = std::exp(estimate.log_change);
  LearntCamera learnt{camera, scale * camera.fx, estimate.deviation, false, problem.MeanSquaredError()};
  learnt.trusted = estimate.deviation <= options.max_deviation;
  if (learnt.trusted) {
    learnt.camera.fx *= scale;
    learnt.camera.fy *= scale;
    if (options.what == LearntPart::kFocalAndRadial) {
      learnt.camera.distortion[0] = problem.Coefficient(1);
      learnt.camera.distortion[1] = problem.Coefficient(2);
    }
    GlobalBundleAdjustment(map, learnt.camera, kSolverSteps);
  }
  return learnt;
}

}  // namespace sqslam
