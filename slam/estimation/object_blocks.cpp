#include "slam/estimation/object_blocks.h"

#include <algorithm>
#include <cmath>

namespace sqslam {

ObjectBlocks::ObjectBlocks(BundleProblem& problem) : problem_(problem) {
  for (const BundleObject& object : problem.objects) {
    starts_.push_back(object.superquadric);
    SuperquadricBlock& block = blocks_.emplace_back(ToBlock(object.superquadric));
    for (std::size_t i = kBlockExponents; i < block.size(); ++i) {
      block[i] = std::clamp(block[i], kMinShapeExponent, kMaxShapeExponent);
    }
    losses_.push_back(std::make_unique<ceres::HuberLoss>(object.huber));
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
    AddResiduals(i, solver);
  }
}

void ObjectBlocks::AddResiduals(std::size_t object, ceres::Problem& solver) {
  const BundleObject& o = problem_.objects[object];
  double* block = blocks_[object].data();
  const Eigen::Quaterniond R_map_start = starts_[object].T_map_object.rotation.normalized();
  const auto factor = [&](double weight) { return std::sqrt(weight) / o.sigma; };
  for (const BundleObject::Point& point : o.points) {
    BundlePoint& p = problem_.points[point.index];
    if (p.alive && point.weight > 0.0) {
      solver.AddResidualBlock(new SurfaceCost(R_map_start, factor(point.weight)), losses_[object].get(),
                              block, p.p_map.data());
    }
  }
  for (const BundleObject::HeldPoint& point : o.held_points) {
    if (point.weight > 0.0) {
      solver.AddResidualBlock(new HeldSurfaceCost(R_map_start, factor(point.weight), point.p_map),
                              losses_[object].get(), block);
    }
  }
  // What no point shows would drift: half of most objects is never seen.
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

void ObjectBlocks::Judge() {
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

}  // namespace sqslam
