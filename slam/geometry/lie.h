#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

#include "slam/geometry/rigid3.h"

// The Lie groups SE(3) and Sim(3) with their tangent spaces.
namespace sqslam {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

inline Eigen::Matrix3d Skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

// Unit quaternion of a rotation vector (radians).
inline Eigen::Quaterniond ExpRotation(const Eigen::Vector3d& w) {
  const double angle = w.norm();
  if (angle < 1e-12) {
    return Eigen::Quaterniond(1.0, 0.5 * w.x(), 0.5 * w.y(), 0.5 * w.z()).normalized();
  }
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle, w / angle));
}

// Rotation vector of a unit quaternion (radians, length at most pi).
inline Eigen::Vector3d LogRotation(const Eigen::Quaterniond& q) {
  const double sign = q.w() < 0.0 ? -1.0 : 1.0;
  const double sine = q.vec().norm();  // of half the angle
  if (sine < 1e-12) {
    return 2.0 * sign * q.vec();
  }
  return 2.0 * std::atan2(sine, sign * q.w()) / sine * sign * q.vec();
}

// Perturbs a pose T_camera_map on the left: rotation by delta[0..2], then translation by delta[3..5]; in the
// camera frame, p' = Exp(w) R p + t + dt.
inline Rigid3d Perturb(const Rigid3d& T_camera_map, const Vector6d& delta) {
  return {(ExpRotation(delta.head<3>()) * T_camera_map.rotation).normalized(),
          T_camera_map.translation + delta.tail<3>()};
}

// A tangent vector of Sim(3) is (w, u, sigma): rotation vector in radians, translation part in the unit of
// the target frame, logarithm of the scale. Sources: H. Strasdat, "Local Accuracy and Global Consistency for
// Efficient Visual SLAM", 2012, chapter 2; E. Eade, "Lie Groups for 2D and 3D Transformations", 2013,
// section 6.
using Vector7d = Eigen::Matrix<double, 7, 1>;
using Matrix7d = Eigen::Matrix<double, 7, 7>;

Sim3d ExpSim3(const Vector7d& x);

// Inverse of ExpSim3 for rotations below pi.
Vector7d LogSim3(const Sim3d& S);

// S Exp(x) S^-1 = Exp(AdjointSim3(S) x).
Matrix7d AdjointSim3(const Sim3d& S);

// J with Exp(x + dx) = Exp(J dx) Exp(x) to first order: (e^ad - I) / ad of the small adjoint of x, by its
// power series on ad / 2^n and n doublings.
Matrix7d LeftJacobianSim3(const Vector7d& x);

}  // namespace sqslam
