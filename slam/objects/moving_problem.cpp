#include "slam/objects/moving_problem.h"

#include <utility>

#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

constexpr int kStill = RefinementProblem::NUM_PARAMETERS;

}  // namespace

MovingProblem::MovingProblem(const RefinementProblem& still, std::vector<double> times,
                             double displacement_sigma)
    : problem_(still),
      camera_centres_(ToVector(still.edges, &RefinementProblem::Edge::camera_centre)),
      times_(std::move(times)),
      displacement_factor_(1.0 / displacement_sigma) {}

bool MovingProblem::operator()(const double* parameters, double* residuals, double* jacobian) const {
  const Eigen::Map<const Parameters> x(parameters);
  const Eigen::Vector3d displacement = x.tail<3>();
  for (std::size_t i = 0; i < times_.size(); ++i) {
    problem_.edges[i].camera_centre = camera_centres_[i] - times_[i] * displacement;
  }
  const int rows = problem_.NumResiduals();
  Eigen::VectorXd still_residuals(rows);
  Eigen::Matrix<double, Eigen::Dynamic, kStill> still_jacobian(rows, kStill);
  problem_(parameters, still_residuals.data(), jacobian != nullptr ? still_jacobian.data() : nullptr);
  Eigen::Map<Eigen::VectorXd>(residuals, rows + 3) << still_residuals, displacement_factor_ * displacement;
  if (jacobian == nullptr) {
    return true;
  }
  Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, NUM_PARAMETERS>> J(jacobian, rows + 3, NUM_PARAMETERS);
  J.setZero();
  J.topLeftCorner(rows, kStill) = still_jacobian;
  for (std::size_t i = 0; i < times_.size(); ++i) {  // edges come first
    const auto row = static_cast<Eigen::Index>(i);
    J.block<1, 3>(row, kStill) = times_[i] * still_jacobian.block<1, 3>(row, RefinementProblem::kCentre);
  }
  J.bottomRightCorner<3, 3>().diagonal().setConstant(displacement_factor_);
  return true;
}

}  // namespace sqslam
