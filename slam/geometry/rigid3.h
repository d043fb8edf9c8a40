#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

namespace sqslam {

// Rigid motion T_a_b: p_a = rotation * p_b + translation.
struct Rigid3d {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Vector3d operator*(const Eigen::Vector3d& p_b) const { return rotation * p_b + translation; }

  // T_a_c = T_a_b * T_b_c
  Rigid3d operator*(const Rigid3d& T_b_c) const {
    return {(rotation * T_b_c.rotation).normalized(), rotation * T_b_c.translation + translation};
  }

  Rigid3d Inverse() const {
    const Eigen::Quaterniond inverse = rotation.conjugate();
    return {inverse, -(inverse * translation)};
  }

  Eigen::Matrix3d RotationMatrix() const { return rotation.toRotationMatrix(); }

  Eigen::Matrix4d Matrix() const {
    Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
    matrix.topLeftCorner<3, 3>() = RotationMatrix();
    matrix.topRightCorner<3, 1>() = translation;
    return matrix;
  }

  bool operator==(const Rigid3d&) const = default;
};

// Returns the smallest rotation from the direction of `a` to the direction of `b`, neither zero; for opposite
// directions half a turn about a perpendicular axis. Eigen's FromTwoVectors would compile a singular value
// decomposition.
inline Eigen::Quaterniond RotationBetween(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d from = a.normalized();
  const Eigen::Vector3d to = b.normalized();
  const double cosine = to.dot(from);
  if (cosine < -1.0 + 1e-12) {
    const Eigen::Vector3d axis = from.unitOrthogonal();
    return {0.0, axis.x(), axis.y(), axis.z()};
  }
  const double twice_w = std::sqrt((1.0 + cosine) * 2.0);
  const Eigen::Vector3d axis = from.cross(to) * (1.0 / twice_w);
  return {0.5 * twice_w, axis.x(), axis.y(), axis.z()};
}

// Similarity S_a_b: p_a = scale * rotation * p_b + translation.
struct Sim3d {
  double scale = 1.0;
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Vector3d operator*(const Eigen::Vector3d& p_b) const {
    return scale * (rotation * p_b) + translation;
  }

  // S_a_c = S_a_b * S_b_c
  Sim3d operator*(const Sim3d& S_b_c) const {
    return {scale * S_b_c.scale, (rotation * S_b_c.rotation).normalized(),
            scale * (rotation * S_b_c.translation) + translation};
  }

  // Transforms the pose of a frame c that keeps its own unit of length.
  Rigid3d operator*(const Rigid3d& T_b_c) const {
    return {(rotation * T_b_c.rotation).normalized(), *this * T_b_c.translation};
  }

  bool operator==(const Sim3d&) const = default;

  // The similarity equal to the rigid motion.
  static Sim3d FromRigid(const Rigid3d& T_a_b) { return {1.0, T_a_b.rotation, T_a_b.translation}; }

  // For a camera frame a: the rigid pose with the same projections of the points of frame b, in frame b's
  // unit of length.
  Rigid3d RigidPose() const { return {rotation, translation / scale}; }

  Eigen::Matrix4d Matrix() const {
    Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
    matrix.topLeftCorner<3, 3>() = scale * rotation.toRotationMatrix();
    matrix.topRightCorner<3, 1>() = translation;
    return matrix;
  }

  Sim3d Inverse() const {
    const Eigen::Quaterniond inverse = rotation.conjugate();
    return {1.0 / scale, inverse, -(inverse * translation) / scale};
  }
};

}  // namespace sqslam
