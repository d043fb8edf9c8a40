#include "slam/objects/refinement_problem.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "slam/geometry/angles.h"
#include "slam/objects/handled_solid.h"
#include "slam/objects/tapered_solid.h"

namespace sqslam {
namespace {

using Gradient = RefinementProblem::Parameters;

constexpr int kPriors = 12;
constexpr int kBounds = 3;
constexpr double kMiddleExponent = 0.5 * (kMinShapeExponent + kMaxShapeExponent);
constexpr double kExponentReach = 0.5 * (kMaxShapeExponent - kMinShapeExponent);

// The parameters, and the terms that all residuals share.
struct State {
  explicit State(const double* x, bool is_tapered = false, bool is_handled = false)
      : centre(x[0], x[1], x[2]),
        half(std::exp(x[3]), std::exp(x[4]), std::exp(x[5])),
        cos_yaw(std::cos(x[RefinementProblem::kYaw])),
        sin_yaw(std::sin(x[RefinementProblem::kYaw])),
        tapered(is_tapered ? 1.0 : 0.0),
        handled(is_handled),
        body(half, is_handled) {
    for (int i = 0; i < 2; ++i) {
      taper[i] = std::exp(tapered * x[RefinementProblem::kTaper + i]);
      const double u = x[RefinementProblem::kExponents + i];
      exponent[i] = kMiddleExponent + kExponentReach * std::sin(u);
      exponent_slope[i] = kExponentReach * std::cos(u);
    }
  }

  Eigen::Vector3d ToObject(const Eigen::Vector3d& v) const {
    return {cos_yaw * v.x() + sin_yaw * v.y(), -sin_yaw * v.x() + cos_yaw * v.y(), v.z()};
  }
  Eigen::Vector3d ToMap(const Eigen::Vector3d& v) const {
    return {cos_yaw * v.x() - sin_yaw * v.y(), sin_yaw * v.x() + cos_yaw * v.y(), v.z()};
  }

  Eigen::Vector3d centre;
  Eigen::Vector3d half;
  double cos_yaw;
  double sin_yaw;
  double exponent[2];  // e1, e2
  double tapered;      // derivative of the log of the tapers by their parameters: 1, or 0 without tapers
  double taper[2];     // of the lower and the upper end
  double exponent_slope[2];  // derivative by the parameter
  bool handled;
  HandledBody body;
};

struct Residual {
  double value = 0.0;
  Gradient gradient = Gradient::Zero();

  void Scale(double factor) {
    value *= factor;
    gradient *= factor;
  }

  // Signed square root of the cost of a normal distribution mixed with an even one, whose density is `even`
  // times the peak of the normal one.
  void MakeMixture(double even) {
    const double normal = std::exp(-0.5 * value * value);
    const double square = -2.0 * std::log((normal + even) / (1.0 + even));
    if (square < 1e-9) {
      Scale(1.0 / std::sqrt(1.0 + even));
      return;
    }
    const double robust = std::copysign(std::sqrt(square), value);
    gradient *= value * normal / ((normal + even) * robust);
    value = robust;
  }

  // Signed square root of weight * Cauchy loss of this width.
  void MakeRobust(double width, double weight) {
    const double square = value * value / (width * width);
    if (square < 1e-9) {
      Scale(std::sqrt(weight));
      return;
    }
    const double robust = std::copysign(std::sqrt(weight * std::log(1.0 + square)) * width, value);
    gradient *= weight * value / (robust * (1.0 + square));
    value = robust;
  }
};

Residual EdgeResidual(const State& state, const double* x, const RefinementProblem::Edge& edge) {
  const Eigen::Vector3d offset = state.centre - edge.camera_centre;
  const double depth = edge.forward_map.dot(offset);
  Residual residual;
  if (depth < 1e-6) {
    residual.value = 1e3;  // behind the camera: no step leads here
    return residual;
  }
  const Eigen::Vector3d n = state.ToObject(edge.normal_map);
  const Eigen::Vector3d u = n.cwiseProduct(state.body.half);
  const double p1 = 2.0 / (2.0 - state.exponent[0]);
  const double p2 = 2.0 / (2.0 - state.exponent[1]);
  const int end = u.z() > 0.0 ? 1 : 0;
  const TaperedSupport body(u, state.taper[end], p1, p2);
  const double body_reach = body.value + state.body.shift * n.x();
  const HandleSupport handle(n, state.half);
  const bool to_handle = state.handled && handle.value > body_reach;
  const double scale = edge.factor / depth;
  const double beyond = scale * (edge.normal_map.dot(offset) + (to_handle ? handle.value : body_reach));
  residual.value = beyond + edge.size * x[RefinementProblem::kBias + edge.side];
  if (!edge.exact && residual.value > 0.0) {
    residual.value = 0.0;
    return residual;
  }
  Gradient& g = residual.gradient;
  g.head<3>() = scale * edge.normal_map - beyond / depth * edge.forward_map;
  g[RefinementProblem::kBias + edge.side] = edge.size;
  if (to_handle) {
    g.segment<3>(RefinementProblem::kLogHalf) = scale * handle.by_log_hull;
    g[RefinementProblem::kYaw] = scale * state.half.x() * n.y();
    return residual;
  }
  const Eigen::Vector3d du = body.by_u.cwiseProduct(state.body.half);
  g.segment<3>(RefinementProblem::kLogHalf) = scale * state.body.ByLogHull(body.by_u.cwiseProduct(u), n.x());
  g[RefinementProblem::kYaw] = scale * ((du.x() + state.body.shift) * n.y() - du.y() * n.x());
  g[RefinementProblem::kExponents] = scale * body.by_p1 * 0.5 * p1 * p1 * state.exponent_slope[0];
  g[RefinementProblem::kExponents + 1] = scale * body.by_p2 * 0.5 * p2 * p2 * state.exponent_slope[1];
  g[RefinementProblem::kTaper + end] = state.tapered * scale * body.by_log_taper;
  return residual;
}

Residual PointResidual(const State& state, const RefinementProblem::Point& point) {
  const Eigen::Vector3d p = state.ToObject(point.p_map - state.centre);
  const int end = p.z() > 0.0 ? 1 : 0;
  const TaperedWidth width(p.z(), state.half.z(), state.taper[end]);
  const Eigen::Vector3d q((p.x() - state.body.shift) / width.value, p.y() / width.value, p.z());
  if (!point.on_surface && q.cwiseQuotient(state.body.half).cwiseAbs().maxCoeff() > 1.0) {
    return {};  // outside the bounding box, as most are
  }
  const RadialDistanceGradient distance =
      Superquadric{state.body.half, state.exponent[0], state.exponent[1]}.RadialDistanceWithGradient(q);
  Residual residual;
  residual.value = distance.value;
  if (!point.on_surface && residual.value > 0.0) {
    residual.value = 0.0;
    return residual;
  }
  const double by_width = -distance.by_point.head<2>().dot(q.head<2>()) / width.value;
  const Eigen::Vector3d dp(distance.by_point.x() / width.value, distance.by_point.y() / width.value,
                           distance.by_point.z() + by_width * width.by_z);
  Gradient& g = residual.gradient;
  g.head<3>() = -state.ToMap(dp);
  g.segment<3>(RefinementProblem::kLogHalf) = state.body.ByLogHull(distance.by_log_half_size, -dp.x());
  g[RefinementProblem::kLogHalf + 2] += by_width * width.by_log_half;
  g[RefinementProblem::kTaper + end] = state.tapered * by_width * width.by_log_taper;
  g[RefinementProblem::kYaw] = dp.x() * p.y() - dp.y() * p.x();
  g[RefinementProblem::kExponents] = distance.by_e1 * state.exponent_slope[0];
  g[RefinementProblem::kExponents + 1] = distance.by_e2 * state.exponent_slope[1];
  residual.Scale(point.factor);
  return residual;
}

// `side`: -1 for the lowest point, 1 for the highest.
Residual ContactResidual(const State& state, const RefinementProblem::Contact& contact, double side) {
  Residual residual;
  residual.value = contact.factor * (state.centre.z() + side * state.half.z() - contact.height);
  if (!contact.exact && residual.value > 0.0) {
    residual.value = 0.0;
    return residual;
  }
  residual.gradient[2] = contact.factor;
  residual.gradient[RefinementProblem::kLogHalf + 2] = side * contact.factor * state.half.z();
  return residual;
}

Residual PriorResidual(const State& state, const double* x, const RefinementProblem::Prior& prior,
                       int index) {
  constexpr int kLogHalf = RefinementProblem::kLogHalf;
  constexpr double kWidth = 2.0;  // of the Cauchy loss: labels may be wrong, objects may lie on their side
  Residual residual;
  // Residual of a weighted sum of the log half sizes.
  const auto sizes = [&](const Eigen::Vector3d& weights, double expected, double factor) {
    const Eigen::Vector3d logs(x[kLogHalf], x[kLogHalf + 1], x[kLogHalf + 2]);
    residual.value = factor * (weights.dot(logs) - expected);
    residual.gradient.segment<3>(kLogHalf) = factor * weights;
    residual.MakeRobust(kWidth, 1.0);
  };
  if (index == 0) {
    sizes({1.0, -1.0, 0.0}, prior.log_width_ratio, prior.width_factor);
  } else if (index == 1) {
    sizes({-0.5, -0.5, 1.0}, prior.log_height_ratio, prior.height_factor);
  } else if (index == 2) {
    sizes(Eigen::Vector3d::Constant(1.0 / 3.0), prior.log_size, prior.size_factor);
  } else if (index < 5) {
    const std::size_t i = static_cast<std::size_t>(index - 3);
    residual.value = prior.exponent_factors[i] * (state.exponent[i] - prior.exponents[i]);
    residual.gradient[RefinementProblem::kExponents + index - 3] =
        prior.exponent_factors[i] * state.exponent_slope[i];
  } else if (index == 5) {
    const double half = 2.0 * (x[RefinementProblem::kYaw] - prior.yaw);
    residual.value = prior.yaw_factor * std::sin(half) / 2.0;
    residual.gradient[RefinementProblem::kYaw] = prior.yaw_factor * std::cos(half);
    if (prior.yaw_factor > 0.0 && prior.yaw_misled > 0.0) {
      const double peak = prior.yaw_factor / std::sqrt(2.0 * std::numbers::pi);
      const double evenly = 2.0 / std::numbers::pi;
      residual.MakeMixture(prior.yaw_misled * evenly / ((1.0 - prior.yaw_misled) * peak));
    }
  } else if (index >= 10) {
    const int end = RefinementProblem::kTaper + index - 10;
    const double factor = x[end] > 0.0 ? RefinementProblem::kStraight : prior.taper_factor;
    residual.value = factor * x[end];
    residual.gradient[end] = factor;
  } else {
    const int side = RefinementProblem::kBias + index - 6;
    residual.value = prior.bias_factor * x[side];
    residual.gradient[side] = prior.bias_factor;
  }
  return residual;
}

}  // namespace

RefinementProblem::Parameters RefinementProblem::Pack(const PosedSuperquadric& superquadric) {
  constexpr double kInside = 0.999;  // the sine has no slope at the bounds
  Parameters x = Parameters::Zero();
  x.head<3>() = superquadric.T_map_object.translation;
  x.segment<3>(kLogHalf) = superquadric.shape.half_size.array().log().matrix();
  x[kYaw] = YawOf(superquadric.T_map_object.rotation);
  const double exponents[2] = {superquadric.shape.e1, superquadric.shape.e2};
  for (int i = 0; i < 2; ++i) {
    x[kExponents + i] =
        std::asin(std::clamp((exponents[i] - kMiddleExponent) / kExponentReach, -kInside, kInside));
  }
  return x;
}

PosedSuperquadric RefinementProblem::Unpack(const Parameters& parameters) {
  const State state(parameters.data());
  PosedSuperquadric superquadric;
  superquadric.shape = {state.half, state.exponent[0], state.exponent[1]};
  superquadric.T_map_object.translation = state.centre;
  superquadric.T_map_object.rotation = Eigen::AngleAxisd(parameters[kYaw], Eigen::Vector3d::UnitZ());
  return superquadric;
}

RefinementProblem::Square RefinementProblem::Information(const Parameters& parameters, int rows) const {
  Eigen::VectorXd residuals(NumResiduals());
  Eigen::MatrixXd jacobian(NumResiduals(), static_cast<int>(NUM_PARAMETERS));
  // The bound of the tapers is no measurement: it must not count as information.
  Parameters inside = parameters;
  inside.segment<2>(kTaper) = inside.segment<2>(kTaper).cwiseMin(0.0);
  (*this)(inside.data(), residuals.data(), jacobian.data());
  constexpr double kWeakest = 1e-6;  // for unobserved directions
  Square information = jacobian.topRows(rows).transpose() * jacobian.topRows(rows);
  information.diagonal() = information.diagonal().cwiseMax(kWeakest);
  information.diagonal() *= 1.0 + 1e-9;
  return information;
}

Eigen::Matrix<double, 9, 9> RefinementProblem::Covariance(const Parameters& parameters) const {
  // Chain rule to sizes and exponents: d half = half d log(half), d e = slope d u.
  const State state(parameters.data());
  Eigen::Matrix<double, 9, 1> slope = Eigen::Matrix<double, 9, 1>::Ones();
  slope.segment<3>(kLogHalf) = state.half;
  slope[kExponents] = state.exponent_slope[0];
  slope[kExponents + 1] = state.exponent_slope[1];
  const Square covariance =
      Information(parameters, NumResiduals() - kBounds).ldlt().solve(Square::Identity());
  return slope.asDiagonal() * covariance.topLeftCorner<9, 9>() * slope.asDiagonal();
}

double RefinementProblem::HalfLogInformation(const Parameters& parameters) const {
  // Exponents and biases are left out, as their priors are alike for all kinds of shape; an unobserved yaw
  // still lies within a quarter turn.
  constexpr std::array<int, 9> kKept = {0, 1, 2, 3, 4, 5, kYaw, kTaper, kTaper + 1};
  constexpr std::array<int, 6> kOthers = {kExponents, kExponents + 1, kBias, kBias + 1, kBias + 2, kBias + 3};
  // A quarter or a whole turn over the square root of 12.
  const double kYawSigma = handled ? 4.0 * 0.4534 : 0.4534;
  Square information = Information(parameters, NumResiduals());
  information(kYaw, kYaw) += 1.0 / (kYawSigma * kYawSigma);
  const Eigen::Matrix<double, 6, 6> others = information(kOthers, kOthers);
  const Eigen::Matrix<double, 6, 9> across = information(kOthers, kKept);
  const Eigen::Matrix<double, 9, 9> kept =
      information(kKept, kKept) - across.transpose() * others.ldlt().solve(across);
  return 0.5 * kept.ldlt().vectorD().array().max(1e-12).log().sum() - 2.0 * std::log(prior.taper_factor);
}

int RefinementProblem::NumResiduals() const {
  return static_cast<int>(edges.size() + points.size()) + (contact ? 1 : 0) + (top ? 1 : 0) + kPriors +
         kBounds;
}

bool RefinementProblem::operator()(const double* parameters, double* residuals, double* jacobian) const {
  constexpr double kEdgeWidth = 1.5;
  constexpr double kBeyondWidth = 0.7;  // what hides or cuts off one edge may shorten the others
  constexpr double kPointWidth = 1.5;
  constexpr double kInside = 0.5;       // objects are more often hollow between their parts than bulging
  constexpr double kBoundSigma = 0.05;  // of a log half size beyond its bound
  const State state(parameters, prior.taper_factor < kStraight, handled);
  const int rows = NumResiduals();
  int row = 0;
  const auto put = [&](const Residual& residual) {
    residuals[row] = residual.value;
    for (int i = 0; jacobian != nullptr && i < NUM_PARAMETERS; ++i) {
      jacobian[i * rows + row] = residual.gradient[i];
    }
    ++row;
  };
  for (const Edge& edge : edges) {
    Residual residual = EdgeResidual(state, parameters, edge);
    const bool alike = symmetric && edge.whole;
    residual.MakeRobust(residual.value > 0.0 && !alike ? kBeyondWidth : kEdgeWidth, 1.0);
    put(residual);
  }
  for (const Point& point : points) {
    Residual residual = PointResidual(state, point);
    if (point.on_surface && residual.value < 0.0) {
      residual.Scale(kInside);
    }
    residual.MakeRobust(kPointWidth, point.weight);
    put(residual);
  }
  if (contact) {
    put(ContactResidual(state, *contact, -1.0));
  }
  if (top) {
    put(ContactResidual(state, *top, 1.0));
  }
  for (int i = 0; i < kPriors; ++i) {
    put(PriorResidual(state, parameters, prior, i));
  }
  for (int i = 0; i < kBounds; ++i) {
    Residual residual;
    const double log_half = parameters[kLogHalf + i];
    const double beyond =
        std::max(0.0, log_half - max_log_half[i]) + std::min(0.0, log_half - min_log_half[i]);
    residual.value = beyond / kBoundSigma;
    residual.gradient[kLogHalf + i] = beyond != 0.0 ? 1.0 / kBoundSigma : 0.0;
    put(residual);
  }
  return true;
}

}  // namespace sqslam
