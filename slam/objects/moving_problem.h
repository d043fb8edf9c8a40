#pragma once

#include <Eigen/Core>
#include <vector>

#include "slam/objects/refinement_problem.h"

namespace sqslam {

// The joint refinement of an object that moves evenly from the first view to the last: RefinementProblem with
// three more parameters, its displacement meanwhile (map frame, map units). For ceres::TinySolver.
class MovingProblem {
 public:
  using Scalar = double;
  enum { NUM_RESIDUALS = Eigen::Dynamic, NUM_PARAMETERS = RefinementProblem::NUM_PARAMETERS + 3 };
  using Parameters = Eigen::Matrix<double, NUM_PARAMETERS, 1>;

  // `times`: of the edges of `still`, from -0.5 at the first view to 0.5 at the last. `displacement_sigma`:
  // standard deviation of the displacement before anything is seen, map units.
  MovingProblem(const RefinementProblem& still, std::vector<double> times, double displacement_sigma);

  int NumResiduals() const { return problem_.NumResiduals() + 3; }

  // `jacobian`: column-major, NumResiduals() x 18; may be null.
  bool operator()(const double* parameters, double* residuals, double* jacobian) const;

 private:
  mutable RefinementProblem problem_;  // its cameras move against the object
  std::vector<Eigen::Vector3d> camera_centres_;
  std::vector<double> times_;
  double displacement_factor_;
};

}  // namespace sqslam
