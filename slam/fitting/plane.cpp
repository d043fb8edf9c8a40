#include "slam/fitting/plane.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cmath>
#include <random>

namespace sqslam {
namespace {

using Eigen::Vector3d;

constexpr int kTrials = 1000;           // finds a plane of a fifth of the points all but surely
constexpr double kLevelCosine = 0.966;  // 15 degrees

std::size_t CountNear(const std::vector<Vector3d>& points, const Plane& plane, double distance) {
  std::size_t count = 0;
  for (const Vector3d& p : points) {
    count += std::abs(plane.Distance(p)) < distance ? 1 : 0;
  }
  return count;
}

Plane LeastSquares(const std::vector<Vector3d>& points, const Plane& start, double distance) {
  Vector3d sum = Vector3d::Zero();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  double count = 0.0;
  for (const Vector3d& p : points) {
    if (std::abs(start.Distance(p)) < distance) {
      sum += p;
      squares += p * p.transpose();
      count += 1.0;
    }
  }
  const Vector3d mean = sum / count;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(squares / count - mean * mean.transpose());
  const Vector3d normal = solver.eigenvectors().col(0);
  return {normal, normal.dot(mean)};
}

}  // namespace

std::optional<Plane> FindLargestPlane(const std::vector<Vector3d>& points, double distance, bool horizontal,
                                      std::uint64_t seed) {
  if (points.size() < 3) {
    return std::nullopt;
  }
  std::mt19937_64 random(seed);
  std::uniform_int_distribution<std::size_t> pick(0, points.size() - 1);
  std::optional<Plane> best;
  std::size_t most = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const Vector3d& a = points[pick(random)];
    const Vector3d& b = points[pick(random)];
    const Vector3d& c = points[pick(random)];
    const Vector3d normal = (b - a).cross(c - a);
    const double length = normal.norm();
    if (length < 1e-9 || (horizontal && std::abs(normal.z()) < kLevelCosine * length)) {
      continue;
    }
    const Plane plane{normal / length, normal.dot(a) / length};
    const std::size_t count = CountNear(points, plane, distance);
    if (count > most) {
      most = count;
      best = plane;
    }
  }
  for (int i = 0; best && i < 3; ++i) {
    best = LeastSquares(points, *best, distance);
  }
  return best;
}

}  // namespace sqslam
