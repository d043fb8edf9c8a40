#include "slam/fitting/fixed_shape_fit.h"

#include <ceres/ceres.h>

#include "slam/fitting/surface_distance.h"

namespace sqslam {
namespace {

constexpr double kNoise = 0.05;  // of the mean half size
constexpr double kPull = 0.1;    // of each half size

// Distance of one point over the noise, by the centre (in the frame of `start`) and the logarithms of the
// half sizes.
class PointCost : public ceres::SizedCostFunction<1, 3, 3> {
 public:
  PointCost(const Eigen::Vector3d& p, const Superquadric& shape, double noise)
      : p_(p), shape_(shape), noise_(noise) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    Superquadric shape = shape_;
    shape.half_size = Eigen::Map<const Eigen::Vector3d>(parameters[1]).array().exp();
    SurfaceDistance::Derivatives by;
    const Eigen::Vector3d p = p_ - Eigen::Map<const Eigen::Vector3d>(parameters[0]);
    residuals[0] = SurfaceDistance(shape)(p, &by) / noise_;
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      Eigen::Vector3d::Map(jacobians[0]) = -by.by_point / noise_;
    }
    if (jacobians != nullptr && jacobians[1] != nullptr) {
      Eigen::Vector3d::Map(jacobians[1]) = by.by_log_half_size / noise_;
    }
    return true;
  }

 private:
  Eigen::Vector3d p_;
  Superquadric shape_;
  double noise_;
};

// How far the six sides (centre minus and plus half size) lie from where they were, over kPull of the half
// size. The sides and not centre and size are held: else a shape seen from above would shrink towards what is
// seen.
struct SidesCost {
  Eigen::Vector3d start;  // half sizes

  template <typename T>
  bool operator()(const T* centre, const T* log_size, T* residuals) const {
    for (int i = 0; i < 3; ++i) {
      const T half = exp(log_size[i]);
      residuals[2 * i] = (centre[i] - half + start[i]) / (kPull * start[i]);
      residuals[2 * i + 1] = (centre[i] + half - start[i]) / (kPull * start[i]);
    }
    return true;
  }
};

}  // namespace

PosedSuperquadric FitPlaceAndSize(std::span<const Eigen::Vector3d> p_map, const PosedSuperquadric& start) {
  if (p_map.empty()) {
    return start;
  }
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Vector3d log_size = start.shape.half_size.array().log();
  ceres::Problem problem;
  const Rigid3d T_object_map = start.T_map_object.Inverse();
  for (const Eigen::Vector3d& p : p_map) {
    problem.AddResidualBlock(
        new PointCost(T_object_map * p, start.shape, kNoise * start.shape.half_size.mean()),
        new ceres::HuberLoss(1.0), centre.data(), log_size.data());
  }
  problem.AddResidualBlock(
      new ceres::AutoDiffCostFunction<SidesCost, 6, 3, 3>(new SidesCost{start.shape.half_size}), nullptr,
      centre.data(), log_size.data());
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.logging_type = ceres::SILENT;
  options.num_threads = 1;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  PosedSuperquadric fitted = start;
  fitted.shape.half_size = log_size.array().exp();
  fitted.T_map_object.translation = start.T_map_object * centre;
  return fitted;
}

}  // namespace sqslam
