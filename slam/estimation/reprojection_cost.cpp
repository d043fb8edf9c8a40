#include "slam/estimation/reprojection_cost.h"

#include <ceres/jet.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "slam/estimation/reprojection_error.h"

namespace sqslam {

PoseBlock ToBlock(const Rigid3d& T_camera_map) {
  const auto& q = T_camera_map.rotation;
  const auto& t = T_camera_map.translation;
  return {q.x(), q.y(), q.z(), q.w(), t.x(), t.y(), t.z()};
}

Rigid3d FromBlock(const double* block) {
  return {Eigen::Quaterniond(block[3], block[0], block[1], block[2]).normalized(),
          Eigen::Vector3d(block[4], block[5], block[6])};
}

bool PerturbationManifold::PlusJacobian(const double*, double* jacobian) const {
  using Jacobian = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  Eigen::Map<Jacobian>(jacobian, ambient_size_, tangent_size_).setIdentity();
  return true;
}

bool PerturbationManifold::MinusJacobian(const double*, double* jacobian) const {
  using Jacobian = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  Eigen::Map<Jacobian>(jacobian, tangent_size_, ambient_size_).setIdentity();
  return true;
}

bool PoseManifold::Plus(const double* x, const double* delta, double* x_plus_delta) const {
  const PoseBlock moved = ToBlock(Perturb(FromBlock(x), Eigen::Map<const Vector6d>(delta)));
  std::ranges::copy(moved, x_plus_delta);
  return true;
}

bool PoseManifold::Minus(const double* y, const double* x, double* y_minus_x) const {
  const Rigid3d to = FromBlock(y);
  const Rigid3d from = FromBlock(x);
  const Eigen::AngleAxisd rotation(to.rotation * from.rotation.conjugate());
  Eigen::Map<Vector6d> difference(y_minus_x);
  difference.head<3>() = rotation.angle() * rotation.axis();
  difference.tail<3>() = to.translation - from.translation;
  return true;
}

namespace {

// A map point in the camera frame, with the terms of its derivatives.
struct PointInCamera {
  // Parameters: a PoseBlock and a point.
  explicit PointInCamera(double const* const* parameters)
      : R(Eigen::Quaterniond(parameters[0][3], parameters[0][0], parameters[0][1], parameters[0][2])
              .toRotationMatrix()),
        rotated(R * Eigen::Map<const Eigen::Vector3d>(parameters[1])),
        p(rotated + Eigen::Map<const Eigen::Vector3d>(parameters[0] + 4)) {}

  // Steps that move it behind the camera are rejected.
  bool InFront() const { return p.z() >= kMinDepth; }

  // Writes the Jacobians by pose and point that are not null; `d_pixel`: derivative of the residual by p.
  void WriteJacobians(const Eigen::Matrix<double, 2, 3>& d_pixel, double** jacobians) const {
    if (jacobians[0] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 2, 7, Eigen::RowMajor>> J(jacobians[0]);
      J.leftCols<3>().noalias() = -d_pixel * Skew(rotated);
      J.middleCols<3>(3) = d_pixel;
      J.col(6).setZero();
    }
    if (jacobians[1] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>> J(jacobians[1]);
      J.noalias() = d_pixel * R;
    }
  }

  Eigen::Matrix3d R;
  Eigen::Vector3d rotated;
  Eigen::Vector3d p;
};

}  // namespace

bool ReprojectionCost::Evaluate(double const* const* parameters, double* residuals,
                                double** jacobians) const {
  const PointInCamera point(parameters);
  if (!point.InFront()) {
    return false;
  }
  const auto& [focal, center, pixel, weight] = measured_;
  const auto [fx, fy] = std::array{focal.x(), focal.y()};
  const Eigen::Vector3d& p = point.p;
  const double inverse_z = 1.0 / p.z();
  const double x = p.x() * inverse_z;
  const double y = p.y() * inverse_z;
  residuals[0] = weight * (fx * x + center.x() - pixel.x());
  residuals[1] = weight * (fy * y + center.y() - pixel.y());
  if (jacobians == nullptr) {
    return true;
  }
  Eigen::Matrix<double, 2, 3> d_pixel;
  d_pixel << fx * inverse_z, 0.0, -fx * x * inverse_z, 0.0, fy * inverse_z, -fy * y * inverse_z;
  d_pixel *= weight;
  point.WriteJacobians(d_pixel, jacobians);
  return true;
}

template <class T>
Eigen::Matrix<T, 2, 1> CameraReprojectionCost::Residual(const Eigen::Matrix<T, 3, 1>& p_camera,
                                                        const T* camera) const {
  using std::exp;
  const LensCoefficients<T> coefficients{camera[1], camera[2], T(coefficients_[2]), T(coefficients_[3]),
                                         T(coefficients_[4])};
  const Eigen::Matrix<T, 2, 1> n(p_camera.x() / p_camera.z(), p_camera.y() / p_camera.z());
  const Eigen::Matrix<T, 2, 1> shown = Distort(lens_, coefficients, n);
  const T scale = exp(camera[0]);
  Eigen::Matrix<T, 2, 1> error;
  for (int i = 0; i < 2; ++i) {
    error[i] = measured_.weight * (measured_.focal[i] * scale * shown[i] + measured_.center[i] +
                                   camera[3 + i] + camera[5] * drift_[i] - measured_.pixel[i]);
  }
  return error;
}

bool CameraReprojectionCost::Evaluate(double const* const* parameters, double* residuals,
                                      double** jacobians) const {
  const PointInCamera point(parameters);
  if (!point.InFront()) {
    return false;
  }
  Eigen::Map<Eigen::Vector2d> error(residuals);
  if (jacobians == nullptr) {
    error = Residual<double>(point.p, parameters[2]);
    return true;
  }
  using Jet = ceres::Jet<double, 9>;  // by p and the camera
  const Eigen::Matrix<Jet, 3, 1> p(Jet(point.p.x(), 0), Jet(point.p.y(), 1), Jet(point.p.z(), 2));
  std::array<Jet, std::tuple_size_v<CameraBlock>> camera;
  for (std::size_t i = 0; i < camera.size(); ++i) {
    camera[i] = Jet(parameters[2][i], 3 + static_cast<int>(i));
  }
  const Eigen::Matrix<Jet, 2, 1> result = Residual<Jet>(p, camera.data());
  error = Eigen::Vector2d(result[0].a, result[1].a);
  Eigen::Matrix<double, 2, 9> J_result;
  J_result << result[0].v.transpose(), result[1].v.transpose();
  point.WriteJacobians(J_result.leftCols<3>(), jacobians);
  if (jacobians[2] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, 2, 6, Eigen::RowMajor>> J(jacobians[2]);
    J = J_result.rightCols<6>();
  }
  return true;
}

}  // namespace sqslam
