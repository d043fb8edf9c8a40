#pragma once

#include <Eigen/Geometry>
#include <cmath>

#include "slam/geometry/rigid3.h"
#include "slam/geometry/superquadric.h"

namespace sqslam::testing {

// A table that hides what stands behind it.
inline constexpr double kTableTop = 0.7;

inline PosedSuperquadric Box(const Eigen::Vector3d& centre, const Eigen::Vector3d& half_size) {
  PosedSuperquadric box;
  box.shape = {half_size, 0.1, 0.1};
  box.T_map_object.translation = centre;
  return box;
}

inline PosedSuperquadric Table() { return Box({0.0, 2.0, 0.35}, {0.8, 0.5, 0.35}); }

// At 1.3 above the floor, looking along y and 20 degrees down.
inline Rigid3d Pose() {
  const Eigen::Vector3d forward(0.0, std::cos(0.35), -std::sin(0.35));
  Eigen::Matrix3d R;
  R.col(0) = Eigen::Vector3d::UnitX();
  R.col(2) = forward;
  R.col(1) = forward.cross(Eigen::Vector3d::UnitX());
  return {Eigen::Quaterniond(R), {0.0, 0.0, 1.3}};
}

}  // namespace sqslam::testing
