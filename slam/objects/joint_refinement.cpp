#include "slam/objects/joint_refinement.h"

#include <ceres/tiny_solver.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <numeric>

#include "slam/geometry/angles.h"
#include "slam/geometry/ray.h"
#include "slam/objects/landmark_geometry.h"
#include "slam/objects/moving_problem.h"
#include "slam/objects/refinement_problem.h"
#include "slam/util/statistics.h"
#include "slam/util/thinned.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

void AddEdges(const SilhouetteView& view, const Camera& camera, const RefinementOptions& options,
              RefinementProblem& problem) {
  const Eigen::Matrix3d R = view.T_map_camera.RotationMatrix();
  const Box2d& box = view.box;
  const std::array<double, 4> at = NormalisedBounds(box, camera);
  const bool whole = std::ranges::all_of(view.edge_exact, std::identity());
  for (std::size_t edge = 0; edge < 4; ++edge) {
    const int axis = static_cast<int>(edge % 2);
    const double outward = edge < 2 ? -1.0 : 1.0;
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    normal[axis] = outward;
    normal[2] = -outward * at[edge];
    const double sigma =
        options.edge_sigma_px + options.edge_sigma_share * (axis == 0 ? box.width : box.height);
    problem.edges.push_back({R * normal, view.T_map_camera.translation, R.col(2),
                             (axis == 0 ? camera.fx : camera.fy) / sigma, static_cast<int>(edge),
                             (axis == 0 ? box.width : box.height) / sigma, view.edge_exact[edge], whole});
  }
}

// Returns a point within the object: the mean of its points, or without points the one nearest to the rays
// through the centres of the boxes.
Eigen::Vector3d PlaceOf(const RefinementInput& input) {
  if (!input.points.empty()) {
    return std::accumulate(input.points.begin(), input.points.end(), Eigen::Vector3d::Zero().eval()) /
           static_cast<double>(input.points.size());
  }
  RaySum rays{.information = 1e-9 * Eigen::Matrix3d::Identity()};
  for (const SilhouetteView& view : input.views) {
    rays.Add({view.T_map_camera.translation,
              (view.T_map_camera.rotation * input.camera.Unproject(view.box.Center())).normalized()});
  }
  return rays.Nearest();
}

// Returns the map units per pixel at the object, at its median depth.
double UnitsPerPixel(const RefinementInput& input, const Eigen::Vector3d& place) {
  std::vector<double> depths = ToVector(
      input.views, [&](const SilhouetteView& view) { return (view.T_map_camera.Inverse() * place).z(); });
  return depths.empty() ? 1e-6 : std::max(UpperMedian(std::move(depths)), 1e-6) / input.camera.fx;
}

// Standard deviation of a point's radial distance due to its depth, map units: the less the cameras moved,
// the less certain the point is along the line of sight. A surface seen at a grazing angle is not affected,
// because the distance is measured along the radius.
double RadialSigma(const Eigen::Vector3d& p, const PointCameras& cameras, const Eigen::Vector3d& place,
                   const Camera& camera, double pixel_sigma) {
  constexpr double kLeastSpread = 0.01;  // of the distance: bundle adjustment ties the depths together
  const Eigen::Vector3d line = p - cameras.mean;
  const double along = std::abs(line.normalized().dot((p - place).normalized()));
  const double spread = std::max(kLeastSpread * line.norm(), cameras.spread);
  return along * pixel_sigma * line.squaredNorm() / (camera.fx * spread);
}

void AddPoints(const RefinementInput& input, const Eigen::Vector3d& place, double shown,
               const RefinementOptions& options, RefinementProblem& problem) {
  constexpr std::size_t kMaxPoints = 75;
  if (input.points.empty()) {
    return;
  }
  const double sigma =
      options.point_sigma_px * UnitsPerPixel(input, place) + options.point_sigma_share * shown;
  const double weight = std::min(
      1.0, 4.0 * options.point_weight / static_cast<double>(std::min(input.points.size(), kMaxPoints)));
  const double step = 0.3 * shown;
  const std::size_t stride = StepThrough(input.points.size(), kMaxPoints);
  for (std::size_t i = 0; i < input.points.size(); i += stride) {
    const Eigen::Vector3d& p = input.points[i];
    if (i >= input.point_cameras.size()) {
      problem.points.push_back({p, 1.0 / sigma, weight, true});
      continue;
    }
    const double radial = RadialSigma(p, input.point_cameras[i], place, input.camera, options.depth_sigma_px);
    problem.points.push_back({p, 1.0 / std::hypot(sigma, radial), weight, true});
    if (i / stride % 2 == 0 && !input.prior.hollow) {
      // A point in front of it on the line of sight is outside.
      const Eigen::Vector3d to_camera = (input.point_cameras[i].mean - p).normalized();
      problem.points.push_back({p + step * to_camera, 1.0 / sigma, 2.0 * weight, false});
    }
  }
}

void AddContact(const RefinementInput& input, double shown, const RefinementOptions& options,
                RefinementProblem& problem) {
  constexpr double kFlat = 0.01;  // standard deviation of a top that others stand on, share of the shown size
  const auto factor = [&](double share) {
    return std::sqrt(options.contact_weight) / std::hypot(share * shown, input.support_sigma);
  };
  const std::optional<double>& floor = input.support_height ? input.support_height : input.lowest;
  if (floor) {
    problem.contact = {*floor, factor(options.contact_sigma), input.support_height.has_value()};
  }
  if (input.top_height) {
    problem.top = {*input.top_height, factor(kFlat), true};
  }
}

// Returns the yaw mode nearest to the start; null without lines.
const YawMode* YawMeant(const PosedSuperquadric& start, const RefinementInput& input) {
  const double yaw = YawOf(start.T_map_object.rotation);
  const auto nearest = std::ranges::min_element(
      input.yaws, {}, [yaw](const YawMode& mode) { return std::abs(WrapQuarter(mode.yaw - yaw)); });
  return nearest == input.yaws.end() ? nullptr : &*nearest;
}

void AddPrior(const Superquadric& start, const YawMode* yaw, const RefinementInput& input,
              const RefinementOptions& options, RefinementProblem& problem) {
  constexpr double kCupTaper = 0.3;
  constexpr double kProfile = 2.0;  // the tapers explain most of what e1 would
  constexpr double kRound = 4.0;    // turned on a lathe or a wheel
  const ClassPrior known = input.shows_back ? BackOf(input.prior) : input.prior;
  RefinementProblem::Prior& prior = problem.prior;
  const double longer = start.half_size.x() >= start.half_size.y() ? 1.0 : -1.0;
  prior.log_width_ratio = longer * known.log_width_ratio;
  prior.width_factor = 1.0 / known.width_sigma;
  prior.log_height_ratio = known.log_height_ratio;
  prior.height_factor = 1.0 / known.height_sigma;
  if (input.scale && known.log_metres) {
    prior.log_size = *known.log_metres - input.scale->log_scale - std::log(2.0);
    prior.size_factor = 1.0 / std::hypot(known.size_sigma, input.scale->sigma);
  }
  const ShapeKind kind = NearestKind(start.e1, start.e2);
  prior.exponents = ExponentsOf(kind);
  prior.exponent_factors.fill(1.0 / options.exponent_sigma);
  if (kind == ShapeKind::kCylinder) {
    prior.exponent_factors[1] *= kRound;
  }
  if (kind == ShapeKind::kCylinder && options.taper_sigma > 0.0) {
    // A handle, not a waist, is what makes the boxes of a cup wide.
    prior.taper_factor = 1.0 / (known.handle > 0.0 ? kCupTaper * options.taper_sigma : options.taper_sigma);
    prior.exponent_factors[0] *= kProfile;
  }
  prior.yaw = yaw != nullptr ? yaw->yaw : 0.0;
  prior.yaw_factor = yaw != nullptr ? 1.0 / yaw->sigma : 0.0;
  prior.bias_factor = 1.0 / options.edge_bias_sigma;
}

// Bounds the half sizes by the extent that the boxes show: along the viewing rays an object seen from one
// side only would grow without bound from update to update. If no box shows the lower end, the object may be
// as high as its support requires.
void SetBounds(const PosedSuperquadric& start, const RefinementInput& input, double shown,
               const RefinementOptions& options, RefinementProblem& problem) {
  constexpr double kLogRange = 6.5;
  constexpr double kTaller = 1.2;  // the top is not known exactly
  const double most = shown > 0.0 ? options.max_stretch * shown : 4.5 * start.shape.half_size.maxCoeff();
  Eigen::Vector3d max_half = Eigen::Vector3d::Constant(most);
  if (input.support_height && !input.ShowsBottom()) {
    const double top = start.T_map_object.translation.z() + start.shape.half_size.z();
    max_half.z() = std::max(most, kTaller * 0.5 * (top - *input.support_height));
  }
  problem.max_log_half = max_half.array().log();
  problem.min_log_half.setConstant(std::log(most) - kLogRange);
}

// Caches the last evaluation: TinySolver evaluates each accepted step twice, first for the cost and then for
// the derivatives, which cost little more.
class RememberingProblem {
 public:
  using Scalar = double;
  enum { NUM_RESIDUALS = Eigen::Dynamic, NUM_PARAMETERS = RefinementProblem::NUM_PARAMETERS };

  explicit RememberingProblem(const RefinementProblem& problem)
      : problem_(problem),
        residuals_(problem.NumResiduals()),
        jacobian_(problem.NumResiduals(), static_cast<int>(NUM_PARAMETERS)) {}

  int NumResiduals() const { return problem_.NumResiduals(); }

  bool operator()(const double* parameters, double* residuals, double* jacobian) const {
    const Eigen::Map<const RefinementProblem::Parameters> x(parameters);
    if (!known_ || *known_ != x) {
      problem_(parameters, residuals_.data(), jacobian_.data());
      known_ = x;
    }
    std::copy_n(residuals_.data(), residuals_.size(), residuals);
    if (jacobian != nullptr) {
      std::copy_n(jacobian_.data(), jacobian_.size(), jacobian);
    }
    return true;
  }

 private:
  const RefinementProblem& problem_;
  mutable std::optional<RefinementProblem::Parameters> known_;
  mutable Eigen::VectorXd residuals_;
  mutable Eigen::Matrix<double, Eigen::Dynamic, NUM_PARAMETERS> jacobian_;
};

// Runs Levenberg-Marquardt from `parameters`, which it updates; returns the final cost.
double Solve(const RefinementProblem& problem, const RefinementOptions& options,
             RefinementProblem::Parameters& parameters) {
  const RememberingProblem remembering(problem);
  ceres::TinySolver<RememberingProblem> solver;
  solver.options.max_num_iterations = options.max_iterations;
  solver.options.function_tolerance = options.cost_tolerance;
  return solver.Solve(remembering, &parameters).final_cost;
}

// The refinement from `start`, with the yaw mode that is meant; null without lines.
struct StartedProblem {
  RefinementProblem problem;
  RefinementProblem::Parameters parameters;
  const YawMode* yaw = nullptr;
  double shown = 0.0;  // largest half diagonal of the boxes, map units
};

StartedProblem Started(const PosedSuperquadric& start, const RefinementInput& input,
                       const RefinementOptions& options) {
  StartedProblem started;
  RefinementProblem& problem = started.problem;
  for (const SilhouetteView& view : input.views) {
    AddEdges(view, input.camera, options, problem);
  }
  const Eigen::Vector3d place = PlaceOf(input);
  started.shown = LargestShown(input.views, place, input.camera);
  AddPoints(input, place, started.shown, options, problem);
  AddContact(input, started.shown, options, problem);
  started.yaw = YawMeant(start, input);
  AddPrior(start.shape, started.yaw, input, options, problem);
  SetBounds(start, input, started.shown, options, problem);
  started.parameters = RefinementProblem::Pack(start);
  auto log_half = started.parameters.segment<3>(RefinementProblem::kLogHalf);
  log_half =
      log_half.array().max(problem.min_log_half.array() + 0.5).min(problem.max_log_half.array() - 0.01);
  return started;
}

// Completes a full refinement from `parameters`, its first solution: with the symmetric loss only now,
// because local minima are more frequent with it.
RefinementResult Complete(RefinementProblem& problem, const RefinementOptions& options, double cost,
                          RefinementProblem::Parameters& parameters) {
  problem.symmetric = std::ranges::any_of(problem.edges, &RefinementProblem::Edge::whole);
  if (problem.symmetric) {
    cost = Solve(problem, options, parameters);
  }
  return {RefinementProblem::Unpack(parameters), cost + problem.HalfLogInformation(parameters),
          problem.Covariance(parameters)};
}

// Refines the object as a round body with a handle, in the direction that `start` leaves likeliest.
RefinementResult RefineHandled(const PosedSuperquadric& start, const RefinementOptions& options,
                               RefinementProblem problem) {
  constexpr double kReach = 1.375;  // half size along the handle over that across: 80 mm and a handle of 30
  constexpr double kReachSigma = 0.1;  // of its logarithm
  constexpr double kAnyYaw = 4.0;      // quarter turns in which the handle may point
  constexpr int kDirections = 12;
  problem.handled = true;
  problem.prior.log_width_ratio = std::log(kReach);
  problem.prior.width_factor = 1.0 / kReachSigma;
  problem.prior.yaw_factor = 0.0;
  PosedSuperquadric hull = start;
  const double width = std::sqrt(start.shape.half_size.head<2>().prod());
  hull.shape.half_size.head<2>() = width * Eigen::Vector2d(std::sqrt(kReach), 1.0 / std::sqrt(kReach));
  // The middle lies between those of the body, where the points are, and of the hull.
  const double step = 0.5 * (hull.shape.half_size.x() - hull.shape.half_size.y());
  RefinementProblem::Parameters best;
  double least = std::numeric_limits<double>::infinity();
  Eigen::VectorXd residuals(problem.NumResiduals());
  for (int i = 0; i < kDirections; ++i) {
    const double yaw = 2.0 * std::numbers::pi * i / kDirections;
    RefinementProblem::Parameters parameters = RefinementProblem::Pack(hull);
    parameters[RefinementProblem::kYaw] = yaw;
    parameters.head<2>() += step * Eigen::Vector2d(std::cos(yaw), std::sin(yaw));
    problem(parameters.data(), residuals.data(), nullptr);
    if (residuals.squaredNorm() < least) {
      least = residuals.squaredNorm();
      best = parameters;
    }
  }
  const double cost = Solve(problem, options, best);
  RefinementResult result = Complete(problem, options, cost, best);
  result.cost += std::log(kAnyYaw);
  return result;
}

}  // namespace

bool RefinementInput::ShowsBottom() const {
  return std::ranges::any_of(views, [](const SilhouetteView& view) { return view.edge_exact[kBottomEdge]; });
}

RefinementResult RefineJointly(const PosedSuperquadric& start, const RefinementInput& input,
                               const RefinementOptions& options, RefinementDepth depth) {
  auto [problem, parameters, yaw, shown] = Started(start, input, options);
  const double cost = Solve(problem, options, parameters);
  const ShapeKind kind = NearestKind(start.shape.e1, start.shape.e2);
  const double kind_cost = -std::log(input.prior.shapes[static_cast<std::size_t>(kind)]);
  const double yaw_cost = yaw != nullptr ? -std::log(yaw->share) : 0.0;
  if (depth == RefinementDepth::kQuick) {
    return {RefinementProblem::Unpack(parameters), cost + kind_cost + yaw_cost,
            Eigen::Matrix<double, 9, 9>::Zero()};
  }
  RefinementResult result = Complete(problem, options, cost, parameters);
  result.cost += kind_cost + yaw_cost + (yaw != nullptr ? std::log(yaw->sigma) : 0.0);
  const double handle = kind == ShapeKind::kCylinder ? input.prior.handle : 0.0;
  if (handle > 0.0) {
    result.cost -= std::log(1.0 - handle);
    problem.symmetric = false;
    RefinementResult handled = RefineHandled(result.superquadric, options, problem);
    handled.cost += kind_cost - std::log(handle);
    return handled.cost < result.cost ? handled : result;
  }
  return result;
}

MotionFit FitMotion(const PosedSuperquadric& at_rest, const PosedSuperquadric& start,
                    const RefinementInput& input, const RefinementOptions& options) {
  constexpr double kDisplacementSigma = 100.0;  // of the object's size: hardly a bound
  constexpr int kStill = RefinementProblem::NUM_PARAMETERS;
  std::vector<double> times;
  for (const SilhouetteView& view : input.views) {
    times.insert(times.end(), 4, view.time);  // its edges
  }
  double cost_at_rest = 0.0;
  double least = std::numeric_limits<double>::infinity();
  MotionFit fit;
  for (const PosedSuperquadric* from : {&at_rest, &start}) {
    auto [problem, parameters, yaw, shown] = Started(*from, input, options);
    problem.symmetric = std::ranges::any_of(problem.edges, &RefinementProblem::Edge::whole);
    if (from == &at_rest) {
      cost_at_rest = Solve(problem, options, parameters);
    }
    const MovingProblem moving(problem, times, kDisplacementSigma * from->shape.half_size.norm());
    MovingProblem::Parameters x = MovingProblem::Parameters::Zero();
    x.head<kStill>() = parameters;
    ceres::TinySolver<MovingProblem> solver;
    solver.options.max_num_iterations = 2 * options.max_iterations;  // the boxes hardly determine the motion
    solver.options.function_tolerance = options.cost_tolerance;
    const double cost = solver.Solve(moving, &x).final_cost;
    if (cost < least) {
      least = cost;
      fit = {cost_at_rest - cost, x.tail<3>(), RefinementProblem::Unpack(x.head<kStill>())};
    }
  }
  return fit;
}

}  // namespace sqslam
