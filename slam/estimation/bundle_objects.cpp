#include "slam/estimation/bundle_objects.h"

#include <ceres/normal_prior.h>

#include <algorithm>
#include <cmath>

namespace sqslam {
namespace {

constexpr double kHuber = 1.0;  // shape errors grow linearly from here, standard deviations

}  // namespace

ObjectBlocks::ObjectBlocks(BundleProblem& problem) : problem_(problem) {
  for (const BundleObject& object : problem.objects) {
    starts_.push_back(object.superquadric);
    SuperquadricBlock& block = blocks_.emplace_back(ToBlock(object.superquadric));
    for (std::size_t i = kBlockExponents; i < block.size(); ++i) {
      block[i] = std::clamp(block[i], kMinShapeExponent, kMaxShapeExponent);
    }
    losses_.push_back(std::make_unique<ceres::HuberLoss>(kHuber));
  }
}

void ObjectBlocks::AddTo(ceres::Problem& solver, ceres::ParameterBlockOrdering& ordering) {
  constexpr int kObjectGroup = 2;
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    double* block = blocks_[i].data();
    solver.AddParameterBlock(block, static_cast<int>(blocks_[i].size()));
    ordering.AddElementToGroup(block, kObjectGroup);
    for (int e = kBlockExponents; e < static_cast<int>(blocks_[i].size()); ++e) {
      solver.SetParameterLowerBound(block, e, kMinShapeExponent);
      solver.SetParameterUpperBound(block, e, kMaxShapeExponent);
    }
    AddResiduals(i, solver, ordering);
  }
}

void ObjectBlocks::AddResiduals(std::size_t object, ceres::Problem& solver,
                                ceres::ParameterBlockOrdering& ordering) {
  BundleObject& o = problem_.objects[object];
  double* block = blocks_[object].data();
  const Eigen::Quaterniond R_map_start = starts_[object].T_map_object.rotation.normalized();
  const auto add = [&](Eigen::Vector3d& p_map, double weight) {
    solver.AddResidualBlock(new SurfaceCost(R_map_start, std::sqrt(weight) / o.sigma), losses_[object].get(),
                            block, p_map.data());
  };
  for (const BundleObject::Point& point : o.points) {
    if (BundlePoint& p = problem_.points[point.index]; p.alive && point.weight > 0.0) {
      add(p.p_map, point.weight);
    }
  }
  for (BundleObject::HeldPoint& point : o.held_points) {
    if (point.weight > 0.0) {
      add(point.p_map, point.weight);
      ordering.AddElementToGroup(point.p_map.data(), 0);
      solver.SetParameterBlockConstant(point.p_map.data());
    }
  }
  // Unobserved sides would drift: half of most objects is never seen.
  const SuperquadricBlock start = ToBlock(starts_[object]);
  ceres::Vector factors = ceres::Vector::Constant(static_cast<int>(start.size()), 1.0 / o.prior);
  factors.head<3>() /= starts_[object].shape.half_size.mean();
  solver.AddResidualBlock(
      new ceres::NormalPrior(factors.asDiagonal(),
                             Eigen::Map<const ceres::Vector>(start.data(), static_cast<int>(start.size()))),
      nullptr, block);
}

void ObjectBlocks::Read() {
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    problem_.objects[i].superquadric = FromBlock(blocks_[i], starts_[i].T_map_object.rotation);
  }
}

double ShapeCost(const BundleObject& object, const BundleProblem& problem) {
  const Rigid3d T_object_map = object.superquadric.T_map_object.Inverse();
  const ceres::HuberLoss huber(kHuber);
  double sum = 0.0;
  const auto add = [&](const Eigen::Vector3d& p_map, double weight) {
    const double distance = object.superquadric.shape.RadialDistance(T_object_map * p_map) / object.sigma;
    double rho[3];
    huber.Evaluate(weight * distance * distance, rho);
    sum += rho[0];
  };
  for (const BundleObject::Point& point : object.points) {
    if (problem.points[point.index].alive) {
      add(problem.points[point.index].p_map, point.weight);
    }
  }
  for (const BundleObject::HeldPoint& point : object.held_points) {
    add(point.p_map, point.weight);
  }
  return sum;
}

void ObjectBlocks::KeepImprovements() {
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    BundleObject& object = problem_.objects[i];
    BundleObject before = object;
    before.superquadric = starts_[i];
    object.improved = ShapeCost(object, problem_) < ShapeCost(before, problem_);
    if (!object.improved) {
      object.superquadric = starts_[i];
    }
  }
}

SuperquadricBlock ToBlock(const PosedSuperquadric& superquadric) {
  SuperquadricBlock block{};
  Eigen::Vector3d::Map(block.data()) = superquadric.T_map_object.translation;
  Eigen::Vector3d::Map(block.data() + kBlockLogHalf) = superquadric.shape.half_size.array().log();
  block[kBlockExponents] = superquadric.shape.e1;
  block[kBlockExponents + 1] = superquadric.shape.e2;
  return block;
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

}  // namespace sqslam
