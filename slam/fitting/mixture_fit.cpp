#include "slam/fitting/mixture_fit.h"

#include <ceres/tiny_solver.h>

#include <algorithm>
#include <cmath>

#include "slam/fitting/surface_measures.h"
#include "slam/geometry/lie.h"

namespace sqslam {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Parameters = Eigen::Matrix<double, 11, 1>;  // log half size, logits of e1 and e2, rotation, translation

constexpr double kLowest = kMinShapeExponent;
constexpr double kSpan = kMaxShapeExponent - kMinShapeExponent;
// Weights of priors that are negligible for some hundred points, but give every direction a minimum: what a
// cloud does not show (an exponent of an unobserved edge) ends at a mean value.
constexpr double kLogitPrior = 0.3;
constexpr double kSizePrior = 0.05;
constexpr double kLogAreaShift = 6.0;  // clouds in canonical units have areas of about e^2.5

double Exponent(double logit) { return kLowest + kSpan / (1.0 + std::exp(-logit)); }

double Logit(double exponent) {
  const double share = std::clamp((exponent - kLowest) / kSpan, 1e-3, 1.0 - 1e-3);
  return std::log(share / (1.0 - share));
}

// Right Jacobian of SO(3): Exp(w + dw) = Exp(w) Exp(J dw).
Matrix3d RightJacobian(const Vector3d& w) {
  const double angle = w.norm();
  const Matrix3d skew = Skew(w);
  if (angle < 1e-6) {
    return Matrix3d::Identity() - 0.5 * skew;
  }
  const double square = angle * angle;
  return Matrix3d::Identity() - (1.0 - std::cos(angle)) / square * skew +
         (angle - std::sin(angle)) / (square * angle) * skew * skew;
}

class Residuals {
 public:
  using Scalar = double;
  enum { NUM_RESIDUALS = Eigen::Dynamic, NUM_PARAMETERS = 11 };

  Residuals(const std::vector<Vector3d>& points, const Eigen::Quaterniond& base, const MixtureModel& model,
            const MixtureFitOptions& options)
      : points_(points), base_(base), model_(model), options_(options) {}

  int NumResiduals() const { return static_cast<int>(points_.size()) + 6; }

  PosedSuperquadric At(const Parameters& x) const {
    PosedSuperquadric result;
    result.shape = {x.head<3>().array().exp(), Exponent(x[3]), Exponent(x[4])};
    result.T_map_object = {(base_ * ExpRotation(x.segment<3>(5))).normalized(), x.tail<3>()};
    return result;
  }

  bool operator()(const double* parameters, double* residuals, double* jacobian) const {
    const Eigen::Map<const Parameters> x(parameters);
    const int rows = NumResiduals();
    const int n = static_cast<int>(points_.size());
    const PosedSuperquadric superquadric = At(x);
    const SurfaceDistance distance(superquadric.shape);
    const Matrix3d R_object_map = superquadric.T_map_object.RotationMatrix().transpose();
    const Matrix3d right = RightJacobian(x.segment<3>(5));
    const double by_logit1 = LogitSlope(superquadric.shape.e1);
    const double by_logit2 = LogitSlope(superquadric.shape.e2);
    Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, 11>> J(jacobian, jacobian == nullptr ? 0 : rows, 11);
    SurfaceDistance::Derivatives derivatives;
    for (int i = 0; i < n; ++i) {
      const Vector3d p = R_object_map * (points_[i] - superquadric.T_map_object.translation);
      const double d = distance(p, jacobian == nullptr ? nullptr : &derivatives);
      double slope = 0.0;
      residuals[i] = Robust(d, jacobian == nullptr ? nullptr : &slope);
      if (jacobian != nullptr) {
        J.row(i).segment<3>(0) = slope * derivatives.by_log_half_size;
        J(i, 3) = slope * derivatives.by_e1 * by_logit1;
        J(i, 4) = slope * derivatives.by_e2 * by_logit2;
        const Vector3d by_rotation = right.transpose() * derivatives.by_point.cross(p);
        J.row(i).segment<3>(5) = slope * by_rotation;
        J.row(i).segment<3>(8) = -slope * (R_object_map.transpose() * derivatives.by_point);
      }
    }
    AddPriors(x, residuals + n, J, n);
    AddArea(superquadric.shape, residuals + n + 5, J, n + 5);
    if (jacobian != nullptr) {
      J(n + 5, 3) *= by_logit1;
      J(n + 5, 4) *= by_logit2;
    }
    if (jacobian != nullptr && options_.upright) {
      J.middleCols<2>(5).setZero();
    }
    return true;
  }

 private:
  static double LogitSlope(double e) { return (e - kLowest) * (kLowest + kSpan - e) / kSpan; }

  // Returns the residual whose half square is the mixture cost, with the sign of d.
  double Robust(double d, double* slope) const {
    const double variance = model_.sigma * model_.sigma;
    const double root = std::sqrt(2.0 * std::max(model_.Cost(d), 0.0));
    if (slope != nullptr) {
      *slope = 0.5 * d * d / variance < 1e-12 ? 1.0 / (model_.sigma * std::sqrt(1.0 + model_.outlier_ratio))
                                              : model_.InlierProbability(d) * std::abs(d) / (variance * root);
    }
    return d < 0.0 ? -root : root;
  }

  static void AddPriors(const Parameters& x, double* residuals, auto& J, int row) {
    for (int i = 0; i < 5; ++i) {
      const double weight = i < 3 ? kSizePrior : kLogitPrior;
      residuals[i] = weight * x[i];
      if (J.rows() > 0) {
        J.row(row + i).setZero();
        J(row + i, i) = weight;
      }
    }
  }

  // sqrt(2 w (log A + K)): the cost w log A as a least-squares residual; K only keeps the radicand positive.
  void AddArea(const Superquadric& shape, double* residual, auto& J, int row) const {
    const bool differentiate = J.rows() > 0;
    Eigen::Matrix<double, 5, 1> gradient;
    const double log_area = LogSurfaceArea(shape, differentiate ? &gradient : nullptr);
    *residual = std::sqrt(2.0 * options_.area_weight * std::max(log_area + kLogAreaShift, 1e-3));
    if (differentiate) {
      J.row(row).setZero();
      if (*residual > 0.0) {
        J.row(row).template head<5>() = options_.area_weight / *residual * gradient;
      }
    }
  }

  const std::vector<Vector3d>& points_;
  Eigen::Quaterniond base_;
  MixtureModel model_;
  MixtureFitOptions options_;
};

}  // namespace

double MixtureModel::Cost(double distance) const {
  const double u = 0.5 * distance * distance / (sigma * sigma);
  return -std::log1p(std::expm1(-u) / (1.0 + outlier_ratio));
}

double MixtureModel::InlierProbability(double distance) const {
  const double density = std::exp(-0.5 * distance * distance / (sigma * sigma));
  return density / (density + outlier_ratio);
}

double MixtureCost(const std::vector<Vector3d>& points, const PosedSuperquadric& superquadric,
                   const MixtureModel& model) {
  const SurfaceDistance distance(superquadric.shape);
  const Matrix3d R_object_map = superquadric.T_map_object.RotationMatrix().transpose();
  double sum = 0.0;
  for (const Vector3d& point : points) {
    sum += model.Cost(distance(R_object_map * (point - superquadric.T_map_object.translation)));
  }
  return sum;
}

MixtureFit FitMixture(const std::vector<Vector3d>& points, const PosedSuperquadric& start,
                      const MixtureModel& model, const MixtureFitOptions& options) {
  const Residuals residuals(points, start.T_map_object.rotation, model, options);
  Parameters x;
  x << start.shape.half_size.array().log().matrix(), Logit(start.shape.e1), Logit(start.shape.e2),
      Vector3d::Zero(), start.T_map_object.translation;
  ceres::TinySolver<Residuals> solver;
  solver.options.max_num_iterations = options.max_iterations;
  solver.options.parameter_tolerance = options.parameter_tolerance;
  solver.options.function_tolerance = 0.0;
  solver.options.initial_trust_region_radius = 1e2;
  solver.Solve(residuals, &x);
  return {residuals.At(x), solver.summary.final_cost};
}

}  // namespace sqslam
