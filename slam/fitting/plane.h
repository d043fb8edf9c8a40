#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

namespace sqslam {

struct Plane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // unit length
  double offset = 0.0;                                // normal . p on the plane

  double Distance(const Eigen::Vector3d& p) const { return normal.dot(p) - offset; }  // signed
};

// The plane with the most points within `distance` (RANSAC, then least squares over those points).
// `horizontal`: only planes whose normal is within 15 degrees of z. Empty where the points are fewer than
// three or no three of them span such a plane.
std::optional<Plane> FindLargestPlane(const std::vector<Eigen::Vector3d>& points, double distance,
                                      bool horizontal, std::uint64_t seed);

}  // namespace sqslam
