#include "slam/estimation/object_cost.h"

#include <algorithm>
#include <cmath>

namespace sqslam {
SuperquadricBlock ToBlock(const PosedSuperquadric& superquadric) {
  const Eigen::Vector3d& c = superquadric.T_map_object.translation;
  const Eigen::Vector3d log_half = superquadric.shape.half_size.array().log();
  return {c.x(),
          c.y(),
          c.z(),
          log_half.x(),
          log_half.y(),
          log_half.z(),
          0.0,
          superquadric.shape.e1,
          superquadric.shape.e2};
}

PosedSuperquadric FromBlock(const SuperquadricBlock& block, const Eigen::Quaterniond& R_map_start) {
  PosedSuperquadric result;
  result.T_map_object.translation = Eigen::Map<const Eigen::Vector3d>(block.data());
  result.T_map_object.rotation =
      (R_map_start * Eigen::Quaterniond(Eigen::AngleAxisd(block[kBlockTurn], Eigen::Vector3d::UnitZ())))
          .normalized();
  result.shape.half_size =
      Eigen::Map<const Eigen::Vector3d>(block.data() + kBlockLogHalf).array().exp().matrix();
  result.shape.e1 = block[kBlockExponents];
  result.shape.e2 = block[kBlockExponents + 1];
  return result;
}

bool SurfaceCost::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const double* block = parameters[0];
  const Eigen::Vector3d offset =
      Eigen::Map<const Eigen::Vector3d>(parameters[1]) - Eigen::Map<const Eigen::Vector3d>(block);
  const double c = std::cos(block[kBlockTurn]);
  const double s = std::sin(block[kBlockTurn]);
  Eigen::Matrix3d R_object_start;
  R_object_start << c, s, 0.0, -s, c, 0.0, 0.0, 0.0, 1.0;
  const Eigen::Matrix3d R_object_map = R_object_start * R_start_map_;
  const Eigen::Vector3d p = R_object_map * offset;
  const Superquadric shape{Eigen::Map<const Eigen::Vector3d>(block + kBlockLogHalf).array().exp(),
                           block[kBlockExponents], block[kBlockExponents + 1]};
  const RadialDistanceGradient distance = shape.RadialDistanceWithGradient(p);
  residuals[0] = factor_ * distance.value;
  residuals[1] = 0.0;
  if (jacobians == nullptr) {
    return true;
  }
  const Eigen::Vector3d& by_point = distance.by_point;
  const Eigen::RowVector3d by_p_map = by_point.transpose() * R_object_map;
  if (jacobians[0] != nullptr) {
    Eigen::Matrix<double, 1, 9> by_block;
    by_block << -by_p_map, distance.by_log_half_size.transpose(), by_point.x() * p.y() - by_point.y() * p.x(),
        distance.by_e1, distance.by_e2;
    Eigen::Map<Eigen::Matrix<double, 2, 9, Eigen::RowMajor>> J(jacobians[0]);
    J.row(0) = factor_ * by_block;
    J.row(1).setZero();
  }
  if (jacobians[1] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>> J(jacobians[1]);
    J.row(0) = factor_ * by_p_map;
    J.row(1).setZero();
  }
  return true;
}

bool HeldSurfaceCost::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const double* with_point[] = {parameters[0], p_map_.data()};
  double* of_block[] = {jacobians != nullptr ? jacobians[0] : nullptr, nullptr};
  return cost_.Evaluate(with_point, residuals, jacobians != nullptr ? of_block : nullptr);
}

}  // namespace sqslam
