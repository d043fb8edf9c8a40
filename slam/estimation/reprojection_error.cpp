#include "slam/estimation/reprojection_error.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "slam/util/statistics.h"

namespace sqslam {
namespace {

void Accumulate(const Camera& camera, const Rigid3d& T_camera_map, const PointObservation& o, bool robust,
                Matrix6d& hessian, Vector6d& gradient) {
  const Eigen::Vector3d p = T_camera_map * o.p_map;
  if (p.z() < kMinDepth) {
    return;
  }
  const Eigen::Vector2d residual = camera.Project(p) - o.pixel;
  const Eigen::Matrix<double, 2, 6> jacobian = PoseJacobian(camera, T_camera_map, p);
  const double squared = residual.squaredNorm() / o.variance;
  const double weight =
      (robust && squared > kChi2TwoDof ? std::sqrt(kChi2TwoDof / squared) : 1.0) / o.variance;
  hessian.noalias() += weight * jacobian.transpose() * jacobian;
  gradient.noalias() += weight * jacobian.transpose() * residual;
}

}  // namespace

int OptimizePose(const Camera& camera, std::vector<PointObservation>& observations, Rigid3d& T_camera_map) {
  constexpr int kRounds = 4;
  constexpr int kIterations = 6;
  constexpr double kMinStep = 1e-7;
  int inliers = 0;
  for (int round = 0; round < kRounds; ++round) {
    const bool robust = round < kRounds - 1;
    for (int iteration = 0; iteration < kIterations; ++iteration) {
      Matrix6d hessian = Matrix6d::Zero();
      Vector6d gradient = Vector6d::Zero();
      for (const PointObservation& o : observations) {
        if (o.inlier) {
          Accumulate(camera, T_camera_map, o, robust, hessian, gradient);
        }
      }
      hessian.diagonal() *= 1.0 + 1e-6;
      const Vector6d step = hessian.ldlt().solve(-gradient);
      if (!step.allFinite()) {
        return 0;
      }
      T_camera_map = Perturb(T_camera_map, step);
      if (step.squaredNorm() < kMinStep * kMinStep) {
        break;
      }
    }
    inliers = 0;
    for (PointObservation& o : observations) {
      o.inlier = SquaredError(camera, T_camera_map * o.p_map, o.pixel, o.variance) <= kChi2TwoDof;
      inliers += o.inlier ? 1 : 0;
    }
    if (inliers < 10) {
      break;
    }
  }
  return inliers;
}

double CornerDeviation(const Camera& camera, const Rigid3d& T_camera_map,
                       const std::vector<Eigen::Vector3d>& p_map) {
  Matrix6d information = Matrix6d::Zero();
  std::vector<double> depths;
  for (const Eigen::Vector3d& p : p_map) {
    const Eigen::Vector3d p_camera = T_camera_map * p;
    const Eigen::Matrix<double, 2, 6> J = PoseJacobian(camera, T_camera_map, p_camera);
    information += J.transpose() * J;
    depths.push_back(p_camera.z());
  }
  const Eigen::FullPivLU<Matrix6d> decomposition(information);
  if (!decomposition.isInvertible()) {
    return std::numeric_limits<double>::infinity();
  }
  const Matrix6d covariance = decomposition.inverse();
  const double depth = UpperMedian(std::move(depths));
  double largest = 0.0;
  for (const double x : {0.0, static_cast<double>(camera.width)}) {
    for (const double y : {0.0, static_cast<double>(camera.height)}) {
      const Eigen::Vector3d corner = depth * camera.Unproject(Eigen::Vector2d(x, y));
      const Eigen::Matrix<double, 2, 6> J = PoseJacobian(camera, T_camera_map, corner);
      largest = std::max(largest, (J * covariance * J.transpose()).trace());
    }
  }
  return std::sqrt(largest);
}

}  // namespace sqslam
