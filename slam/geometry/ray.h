#pragma once

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

// Returns the distances, in lengths of the direction, at which a ray enters and leaves a solid; the first is
// 0 from inside. Empty if it misses the solid or the solid is behind.
std::optional<std::pair<double, double>> Intersect(const Ray& ray, const PosedSuperquadric& solid);

}  // namespace sqslam
