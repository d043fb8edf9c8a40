#pragma once

#include <ceres/ceres.h>
#include <ceres/normal_prior.h>

#include <memory>
#include <vector>

#include "slam/estimation/bundle_problem.h"
#include "slam/estimation/object_cost.h"

namespace sqslam {

// The objects' part of a bundle adjustment under way. Holds their parameter blocks, so it must outlive every
// ceres::Problem that it was added to.
class ObjectBlocks {
 public:
  explicit ObjectBlocks(BundleProblem& problem);

  // The points' blocks must be in `solver` already. Points stay what is eliminated (group 0). Superquadrics
  // come in a group of their own, after the cameras (group 1): within a group Ceres orders by address, and
  // which of two vectors lies first in memory differs from run to run.
  void AddTo(ceres::Problem& solver, ceres::ParameterBlockOrdering& ordering);

  void Read();  // the blocks' values into the problem

  // Keeps each superquadric where it fits the points better now than the one that was given, otherwise takes
  // it back.
  void Judge();

 private:
  void AddResiduals(std::size_t object, ceres::Problem& solver);

  BundleProblem& problem_;
  std::vector<PosedSuperquadric> starts_;
  std::vector<SuperquadricBlock> blocks_;
  std::vector<std::unique_ptr<ceres::LossFunction>> losses_;
};

}  // namespace sqslam
