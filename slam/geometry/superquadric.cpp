#include "slam/geometry/superquadric.h"

#include <algorithm>
#include <boost/math/special_functions/beta.hpp>
#include <cmath>
#include <limits>

#include "slam/geometry/superquadric_norm.h"

namespace sqslam {
namespace {

// sign(base) |base|^exponent. cos(pi/2) is 6e-17 in floating point, and its power 0.1 would be 0.024 instead
// of 0: rounding errors of an exact zero must be zeroed first.
double SignedPower(double base, double exponent) {
  constexpr double kRoundingError = 4.0 * std::numeric_limits<double>::epsilon();
  const double magnitude = std::abs(base);
  return magnitude < kRoundingError ? 0.0 : std::copysign(std::pow(magnitude, exponent), base);
}

}  // namespace

Eigen::Vector3d Superquadric::PointAt(double eta, double omega) const {
  const double ring = SignedPower(std::cos(eta), e1);
  return half_size.cwiseProduct(Eigen::Vector3d(ring * SignedPower(std::cos(omega), e2),
                                                ring * SignedPower(std::sin(omega), e2),
                                                SignedPower(std::sin(eta), e1)));
}

Eigen::Vector3d Superquadric::NormalAt(double eta, double omega) const {
  const double ring = SignedPower(std::cos(eta), 2.0 - e1);
  const Eigen::Vector3d dual(ring * SignedPower(std::cos(omega), 2.0 - e2),
                             ring * SignedPower(std::sin(omega), 2.0 - e2),
                             SignedPower(std::sin(eta), 2.0 - e1));
  return dual.cwiseQuotient(half_size / half_size.maxCoeff()).normalized();
}

double Superquadric::RadialScale(const Eigen::Vector3d& p_object) const {
  const Eigen::Vector3d unit = p_object.cwiseQuotient(half_size);
  return SuperellipseNorm(SuperellipseNorm(unit.x(), unit.y(), e2), unit.z(), e1);
}

double Superquadric::F(const Eigen::Vector3d& p_object) const {
  return std::min(std::pow(RadialScale(p_object), 2.0 / e1), std::numeric_limits<double>::max());
}

double Superquadric::RadialDistance(const Eigen::Vector3d& p_object) const {
  const double largest = p_object.cwiseAbs().maxCoeff();
  if (largest < std::numeric_limits<double>::min()) {
    return -half_size.minCoeff();
  }
  // The distance from the centre to the surface only depends on the direction: at unit length it is exact
  // even if p is close to the centre.
  const Eigen::Vector3d direction = p_object / largest;
  return p_object.stableNorm() - direction.norm() / RadialScale(direction);
}

RadialDistanceGradient Superquadric::RadialDistanceWithGradient(const Eigen::Vector3d& p_object) const {
  const double p1 = 2.0 / e1;
  const double p2 = 2.0 / e2;
  const double length = std::max(p_object.norm(), 1e-9);
  const Eigen::Vector3d unit = p_object.cwiseQuotient(half_size);
  const SuperquadricNorm<PNormWithSlope> scale(unit, p1, p2);
  if (scale.Value() == 0.0) {
    return {-half_size.minCoeff()};
  }
  const double by_scale = length / (scale.Value() * scale.Value());
  const Eigen::Vector3d by_unit = scale.Gradient();
  RadialDistanceGradient distance;
  distance.value = length * (1.0 - 1.0 / scale.Value());
  distance.by_point =
      (1.0 - 1.0 / scale.Value()) / length * p_object + by_scale * by_unit.cwiseQuotient(half_size);
  distance.by_log_half_size = -by_scale * by_unit.cwiseProduct(unit);
  distance.by_e1 = by_scale * scale.whole.by_p * -0.5 * p1 * p1;
  distance.by_e2 = by_scale * scale.whole.by_x * scale.section.by_p * -0.5 * p2 * p2;
  return distance;
}

Eigen::Vector3d Superquadric::SupportPoint(const Eigen::Vector3d& n_object) const {
  const SuperquadricNorm<PNorm> support(n_object.cwiseProduct(half_size), DualPower(e1), DualPower(e2));
  return half_size.cwiseProduct(support.Gradient());
}

double Superquadric::SupportExtent(const Eigen::Vector3d& n_object) const {
  return SuperquadricNorm<PNorm>(n_object.cwiseProduct(half_size), DualPower(e1), DualPower(e2)).Value();
}

namespace {

// Without promotion to long double, which takes ten times as long.
double Beta(double a, double b) {
  using Policy = boost::math::policies::policy<boost::math::policies::promote_double<false>>;
  return boost::math::beta(a, b, Policy());
}

}  // namespace

double Superquadric::Volume() const {
  return 2.0 * half_size.prod() * e1 * e2 * Beta(0.5 * e1 + 1.0, e1) * Beta(0.5 * e2, 0.5 * e2);
}

Eigen::Vector3d Superquadric::MeanSquares() const {
  const double across = Beta(1.5 * e2, 0.5 * e2) * Beta(0.5 * e1, 2.0 * e1 + 1.0);
  const double along = 4.0 * Beta(0.5 * e2, 0.5 * e2 + 1.0) * Beta(1.5 * e1, e1 + 1.0);
  return 0.5 * half_size.prod() * e1 * e2 / Volume() *
         half_size.cwiseAbs2().cwiseProduct(Eigen::Vector3d(across, across, along));
}

PosedSuperquadric operator*(const Sim3d& S_new_map, const PosedSuperquadric& superquadric) {
  PosedSuperquadric result{superquadric.shape, S_new_map * superquadric.T_map_object};
  result.shape.half_size *= S_new_map.scale;
  return result;
}

Eigen::Vector3d SupportPoint(const PosedSuperquadric& superquadric, const Eigen::Vector3d& n_map) {
  const Rigid3d& T = superquadric.T_map_object;
  return T * superquadric.shape.SupportPoint(T.rotation.conjugate() * n_map);
}

double SupportExtent(const PosedSuperquadric& superquadric, const Eigen::Vector3d& n_map) {
  return superquadric.shape.SupportExtent(superquadric.T_map_object.rotation.conjugate() * n_map);
}

SuperquadricParameters ToParameters(const PosedSuperquadric& superquadric) {
  const Eigen::Matrix3d R = superquadric.T_map_object.RotationMatrix();
  const double roll = std::atan2(R(2, 1), R(2, 2));
  const double pitch = std::asin(std::clamp(-R(2, 0), -1.0, 1.0));
  const double yaw = std::atan2(R(1, 0), R(0, 0));
  SuperquadricParameters parameters;
  parameters << superquadric.shape.half_size, superquadric.shape.e1, superquadric.shape.e2, roll, pitch, yaw,
      superquadric.T_map_object.translation;
  return parameters;
}

}  // namespace sqslam
