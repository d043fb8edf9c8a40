#include "slam/estimation/object_cost.h"

#include <algorithm>
#include <cmath>

namespace sqslam {
namespace {

using RowJacobian = Eigen::Matrix<double, 1, 9, Eigen::RowMajor>;

// Smoothed by a millionth, so that derivatives exist where a coordinate is zero.
double SmoothAbs(double x) { return std::sqrt(x * x + 1e-12); }

// N = (a^p + b^p)^(1/p) of positive numbers, and its derivatives.
struct PNorm {
  double value, by_a, by_b, by_p;

  PNorm(double a, double b, double p) {
    const double larger = std::max(a, b);
    value = larger * std::pow(1.0 + std::pow(std::min(a, b) / larger, p), 1.0 / p);
    const double ratio_a = a / value;
    const double ratio_b = b / value;
    const double share_a = std::pow(ratio_a, p);  // the shares' sum is 1
    const double share_b = std::pow(ratio_b, p);
    by_a = share_a / ratio_a;
    by_b = share_b / ratio_b;
    by_p = value / p * (share_a * std::log(ratio_a) + share_b * std::log(ratio_b));
  }
};

// G and its derivatives: those by the point in the object's axes, and those by half sizes and exponents at
// their places in `by_block`.
double RadialDistance(const double* block, const Eigen::Vector3d& p, Eigen::RowVector3d& by_point,
                      RowJacobian& by_block) {
  Eigen::Vector3d ratio;
  Eigen::RowVector3d ratio_by_p;
  for (int i = 0; i < 3; ++i) {
    const double inverse_half = std::exp(-block[kBlockLogHalf + i]);
    const double x = p[i] * inverse_half;
    ratio[i] = SmoothAbs(x);
    ratio_by_p[i] = x / ratio[i] * inverse_half;
  }
  const double e1 = block[kBlockExponents];
  const double e2 = block[kBlockExponents + 1];
  const PNorm horizontal(ratio.x(), ratio.y(), 2.0 / e2);
  const PNorm scale(horizontal.value, ratio.z(), 2.0 / e1);
  const double norm = std::sqrt(p.squaredNorm() + 1e-12);
  const double by_scale = norm / (scale.value * scale.value);
  const Eigen::RowVector3d by_ratio =
      by_scale * Eigen::RowVector3d(scale.by_a * horizontal.by_a, scale.by_a * horizontal.by_b, scale.by_b);
  const double inside = 1.0 - 1.0 / scale.value;
  by_point = by_ratio.cwiseProduct(ratio_by_p) + inside / norm * p.transpose();
  by_block.setZero();
  // d(x / a) / d(log a) = -x / a
  by_block.segment<3>(kBlockLogHalf) = -by_ratio.cwiseProduct(ratio_by_p).cwiseProduct(p.transpose());
  by_block[kBlockExponents] = by_scale * scale.by_p * (-2.0 / (e1 * e1));
  by_block[kBlockExponents + 1] = by_scale * scale.by_a * horizontal.by_p * (-2.0 / (e2 * e2));
  return norm * inside;
}

}  // namespace

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
  Eigen::RowVector3d by_point;
  RowJacobian by_block;
  residuals[0] = factor_ * RadialDistance(block, p, by_point, by_block);
  residuals[1] = 0.0;
  if (jacobians == nullptr) {
    return true;
  }
  const Eigen::RowVector3d by_p_map = by_point * R_object_map;
  if (jacobians[0] != nullptr) {
    by_block.head<3>() = -by_p_map;
    by_block[kBlockTurn] = by_point.x() * p.y() - by_point.y() * p.x();
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
