#include "slam/scene/object_sampling.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace sqslam {
namespace {

using Matrix9 = Eigen::Matrix<double, 9, 9>;
using Vector9 = Eigen::Matrix<double, 9, 1>;

// Returns the lower triangular L with L L^T = `covariance`. Rounding may have left it slightly indefinite:
// columns without variance are zero, and no variance is exceeded.
Matrix9 CholeskyFactor(const Matrix9& covariance) {
  Matrix9 L = Matrix9::Zero();
  for (int i = 0; i < 9; ++i) {
    const double variance = covariance(i, i) - L.row(i).squaredNorm();
    if (variance <= 1e-9 * covariance(i, i)) {
      continue;
    }
    L(i, i) = std::sqrt(variance);
    for (int j = i + 1; j < 9; ++j) {
      const double left = std::sqrt(std::max(0.0, covariance(j, j) - L.row(j).squaredNorm()));
      L(j, i) = std::clamp((covariance(j, i) - L.row(j).dot(L.row(i))) / L(i, i), -left, left);
    }
  }
  return L;
}

// Draws from a standard normal distribution (Box and Muller), the same with every standard library.
double Normal(std::mt19937& random) {
  const double u = (random() + 1.0) / 4294967297.0;
  const double v = random() / 4294967296.0;
  return std::sqrt(-2.0 * std::log(u)) * std::cos(2.0 * std::numbers::pi * v);
}

}  // namespace

PosedSuperquadric SampleOf(const SnapshotObject& object, std::mt19937& random) {
  Vector9 normal;
  for (double& value : normal) {
    value = Normal(random);
  }
  const Vector9 change = CholeskyFactor(object.fit.covariance) * normal;
  PosedSuperquadric sample = object.superquadric;
  sample.T_map_object.translation += change.head<3>();
  for (int i = 0; i < 3; ++i) {  // a size stays above a tenth of the estimate
    double& half = sample.shape.half_size[i];
    half = std::max(half + change[3 + i], 0.1 * half);
  }
  sample.T_map_object.rotation =
      Eigen::AngleAxisd(change[6], Eigen::Vector3d::UnitZ()) * sample.T_map_object.rotation;
  sample.shape.e1 = std::clamp(sample.shape.e1 + change[7], kMinShapeExponent, kMaxShapeExponent);
  sample.shape.e2 = std::clamp(sample.shape.e2 + change[8], kMinShapeExponent, kMaxShapeExponent);
  return sample;
}

}  // namespace sqslam
