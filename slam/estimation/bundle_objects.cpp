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
  const Eigen::Matrix3d R_start_map =
      starts_[object].T_map_object.rotation.normalized().conjugate().toRotationMatrix();
  const auto add = [&](Eigen::Vector3d& p_map, double weight) {
    solver.AddResidualBlock(new ceres::AutoDiffCostFunction<SurfaceCost, 2, 9, 3>(
                                new SurfaceCost{R_start_map, std::sqrt(weight) / o.sigma}),
                            losses_[object].get(), block, p_map.data());
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

}  // namespace sqslam
