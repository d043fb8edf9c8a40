#include "slam/fitting/mixture_fit.h"

#include <ceres/rotation.h>
#include <ceres/tiny_solver.h>
#include <ceres/tiny_solver_autodiff_function.h>

#include <algorithm>
#include <array>
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

template <typename T>
T Exponent(const T& logit) {
  using std::exp;
  return kLowest + kSpan / (1.0 + exp(-logit));
}

double Logit(double exponent) {
  const double share = std::clamp((exponent - kLowest) / kSpan, 1e-3, 1.0 - 1e-3);
  return std::log(share / (1.0 - share));
}

class Residuals {
 public:
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

  template <typename T>
  bool operator()(const T* x, T* residuals) const {
    using std::exp, std::sqrt;
    using Vector = Eigen::Matrix<T, 3, 1>;
    const T e1 = Exponent(x[3]);
    const T e2 = Exponent(x[4]);
    const Vector half_size(exp(x[0]), exp(x[1]), exp(x[2]));
    const SurfaceDistanceOf<T> distance(half_size, e1, e2);
    const std::array<T, 3> inverse = {options_.upright ? T(0.0) : T(-x[5]),
                                      options_.upright ? T(0.0) : T(-x[6]), -x[7]};
    Eigen::Matrix<T, 3, 3> R_object_base;
    ceres::AngleAxisToRotationMatrix(inverse.data(), R_object_base.data());
    const Matrix3d R_base_map = base_.toRotationMatrix().transpose();
    const Vector origin = R_base_map.cast<T>() * Eigen::Map<const Vector>(x + 8);
    for (const Vector3d& point : points_) {
      const Vector p = (R_base_map * point).cast<T>() - origin;
      *residuals++ = Robust(distance(R_object_base * p));
    }
    for (int i = 0; i < 5; ++i) {
      *residuals++ = (i < 3 ? kSizePrior : kLogitPrior) * x[i];
    }
    // The cost w log A as a least-squares residual; the shift only keeps the radicand positive.
    const T area = LogSurfaceArea<T>(half_size, e1, e2) + kLogAreaShift;
    *residuals =
        options_.area_weight > 0.0 && area > 1e-3 ? T(sqrt(2.0 * options_.area_weight * area)) : T(0.0);
    return true;
  }

 private:
  // Returns the residual whose half square is the mixture cost, with the sign of d.
  template <typename T>
  T Robust(const T& d) const {
    using std::sqrt;
    const T square = 2.0 * model_.Cost(d);
    if (square < 1e-12) {
      return d / (model_.sigma * std::sqrt(1.0 + model_.outlier_ratio));
    }
    return d < 0.0 ? T(-sqrt(square)) : T(sqrt(square));
  }

  const std::vector<Vector3d>& points_;
  Eigen::Quaterniond base_;
  MixtureModel model_;
  MixtureFitOptions options_;
};

}  // namespace

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
  using Derived = ceres::TinySolverAutoDiffFunction<Residuals, Eigen::Dynamic, 11>;
  ceres::TinySolver<Derived> solver;
  solver.options.max_num_iterations = options.max_iterations;
  solver.options.parameter_tolerance = options.parameter_tolerance;
  solver.options.function_tolerance = 0.0;
  solver.options.initial_trust_region_radius = 1e2;
  solver.Solve(Derived(residuals), &x);
  return {residuals.At(x), solver.summary.final_cost};
}

}  // namespace sqslam
