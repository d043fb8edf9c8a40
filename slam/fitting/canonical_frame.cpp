#include "slam/fitting/canonical_frame.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "slam/util/error.h"

namespace sqslam {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

struct Moments {
  Vector3d mean = Vector3d::Zero();
  Matrix3d covariance = Matrix3d::Zero();
};

template <typename Weight>
Moments WeightedMoments(const std::vector<Vector3d>& points, const Weight& weight) {
  Moments moments;
  double sum = 0.0;
  for (const Vector3d& p : points) {
    const double w = weight(p);
    sum += w;
    moments.mean += w * p;
    moments.covariance += w * p * p.transpose();
  }
  moments.mean /= sum;
  moments.covariance = moments.covariance / sum - moments.mean * moments.mean.transpose();
  return moments;
}

// The signed third moment along an axis tells its direction.
Vector3d Directed(const Vector3d& axis, const std::vector<Vector3d>& points, const Vector3d& mean) {
  double third = 0.0;
  for (const Vector3d& p : points) {
    const double x = axis.dot(p - mean);
    third += x * x * x / (1.0 + x * x);
  }
  return third < 0.0 ? Vector3d(-axis) : axis;
}

Matrix3d PrincipalAxes(const Matrix3d& covariance, const std::vector<Vector3d>& points, const Vector3d& mean,
                       bool upright) {
  Matrix3d axes = Matrix3d::Identity();
  if (upright) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(covariance.topLeftCorner<2, 2>());
    axes.col(0).head<2>() = solver.eigenvectors().col(1);
    axes.col(0) = Directed(axes.col(0), points, mean);
    axes.col(1) = axes.col(2).cross(axes.col(0));
    return axes;
  }
  const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(covariance);
  axes.col(0) = Directed(solver.eigenvectors().col(2), points, mean);
  axes.col(1) = Directed(solver.eigenvectors().col(1), points, mean);
  axes.col(2) = axes.col(0).cross(axes.col(1));
  return axes;
}

}  // namespace

CanonicalCloud ToCanonicalFrame(std::span<const Vector3d> cloud, bool upright) {
  constexpr std::size_t kLeast = 11;  // parameters of a superquadric
  if (cloud.size() < kLeast) {
    throw InputError(
        fmt::format("{} points, expected at least {} to fit a superquadric", cloud.size(), kLeast));
  }
  const Vector3d mean = std::accumulate(cloud.begin(), cloud.end(), Vector3d(0.0, 0.0, 0.0)) /
                        static_cast<double>(cloud.size());
  double square = 0.0;
  double largest = 0.0;
  for (const Vector3d& p : cloud) {
    square += (p - mean).squaredNorm() / static_cast<double>(cloud.size());
    largest = std::max(largest, p.cwiseAbs().maxCoeff());
  }
  const double radius = std::sqrt(square);
  if (!(radius > 1e-12 * largest) || !std::isfinite(radius)) {
    throw InputError("the points of the cloud coincide, expected points on the surface of an object");
  }
  std::vector<Vector3d> normalized;
  normalized.reserve(cloud.size());
  for (const Vector3d& p : cloud) {
    normalized.push_back((p - mean) / radius);
  }
  const Moments moments = WeightedMoments(normalized, [](const Vector3d& p) {
    const double square_distance = p.squaredNorm();
    return 1.0 / (1.0 + square_distance * square_distance);
  });
  const Matrix3d axes = PrincipalAxes(moments.covariance, normalized, moments.mean, upright);
  const double unit = std::sqrt(moments.covariance.trace());
  CanonicalCloud result;
  result.S_map_canonical = {radius * unit, Eigen::Quaterniond(axes).normalized(),
                            mean + radius * moments.mean};
  std::vector<Vector3d> points;
  for (const Vector3d& p : normalized) {
    points.push_back(axes.transpose() * (p - moments.mean) / unit);
  }
  result.source.resize(points.size());
  std::iota(result.source.begin(), result.source.end(), std::size_t{0});
  std::sort(result.source.begin(), result.source.end(), [&](std::size_t a, std::size_t b) {
    return std::lexicographical_compare(points[a].begin(), points[a].end(), points[b].begin(),
                                        points[b].end());
  });
  for (const std::size_t index : result.source) {
    result.points.push_back(points[index]);
  }
  return result;
}

}  // namespace sqslam
