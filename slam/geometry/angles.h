#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace sqslam {

inline constexpr double kDegreesPerRadian = 180.0 / std::numbers::pi;
inline constexpr double kRadiansPerDegree = std::numbers::pi / 180.0;
inline constexpr double kGoldenAngle = 2.399963229728653;  // radians; steps of this angle spread evenly

// Wraps an angle modulo 90 degrees to [-pi/4, pi/4): a quarter turn with a_x and a_y swapped does not change
// a superquadric.
inline double WrapQuarter(double yaw) {
  const double wrapped = std::remainder(yaw, std::numbers::pi / 2.0);
  return wrapped >= std::numbers::pi / 4.0 ? wrapped - std::numbers::pi / 2.0 : wrapped;
}

// Returns the angle of the rotated x axis about the z axis, radians in (-pi, pi].
inline double YawOf(const Eigen::Quaterniond& rotation) {
  const Eigen::Vector3d x_axis = rotation * Eigen::Vector3d::UnitX();
  return std::atan2(x_axis.y(), x_axis.x());
}

}  // namespace sqslam
