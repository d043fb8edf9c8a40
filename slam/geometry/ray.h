#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <optional>
#include <utility>

#include "slam/geometry/superquadric.h"

namespace sqslam {

// A line of sight, map frame.
struct Ray {
  Eigen::Vector3d origin;
  Eigen::Vector3d direction;  // of any length > 0
};

// Sums the squared distances of a point from rays.
struct RaySum {
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  Eigen::Vector3d weighted = Eigen::Vector3d::Zero();

  // `ray`: with a direction of length 1.
  void Add(const Ray& ray, double weight = 1.0) {
    const Eigen::Matrix3d across =
        weight * (Eigen::Matrix3d::Identity() - ray.direction * ray.direction.transpose());
    information += across;
    weighted += across * ray.origin;
  }

  // Returns the point with the least sum.
  Eigen::Vector3d Nearest() const { return information.ldlt().solve(weighted); }
};

// Returns the distances, in lengths of the direction, at which a ray enters and leaves a solid; the first is
// 0 from inside. Empty if it misses the solid or the solid is behind.
std::optional<std::pair<double, double>> Intersect(const Ray& ray, const PosedSuperquadric& solid);

}  // namespace sqslam
