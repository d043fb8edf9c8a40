#include "slam/fitting/fixed_shape_fit.h"

#include <ceres/ceres.h>

#include <cmath>

#include "slam/fitting/surface_measures.h"

namespace sqslam {
namespace {

constexpr double kNoise = 0.05;  // of the mean half size
constexpr double kPull = 0.1;    // of each half size

// Distance of a point over the noise. Parameters: centre (in the frame of `start`), logarithms of the half
// sizes, rotation about the z axis.
class PointCost : public ceres::SizedCostFunction<1, 3, 3, 1> {
 public:
  PointCost(const Eigen::Vector3d& p, const Superquadric& shape, double noise)
      : p_(p), shape_(shape), noise_(noise) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    Superquadric shape = shape_;
    shape.half_size = Eigen::Map<const Eigen::Vector3d>(parameters[1]).array().exp();
    SurfaceDistance::Derivatives by;
    const Eigen::Matrix3d R_start_object =
        Eigen::AngleAxisd(parameters[2][0], Eigen::Vector3d::UnitZ()).toRotationMatrix();
    const Eigen::Vector3d p =
        R_start_object.transpose() * (p_ - Eigen::Map<const Eigen::Vector3d>(parameters[0]));
    residuals[0] = SurfaceDistance(shape)(p, &by) / noise_;
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      Eigen::Vector3d::Map(jacobians[0]) = -(R_start_object * by.by_point) / noise_;
    }
    if (jacobians != nullptr && jacobians[1] != nullptr) {
      Eigen::Vector3d::Map(jacobians[1]) = by.by_log_half_size / noise_;
    }
    if (jacobians != nullptr && jacobians[2] != nullptr) {
      jacobians[2][0] = (by.by_point.x() * p.y() - by.by_point.y() * p.x()) / noise_;
    }
    return true;
  }

 private:
  Eigen::Vector3d p_;
  Superquadric shape_;
  double noise_;
};

// Prior on the six sides (centre minus and plus half size), with a standard deviation of kPull of the half
// size. Priors on centre and size instead would let a shape seen from above shrink to its visible part.
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

// Keeps the first two of three parameters equal.
struct EqualFirstTwo {
  template <typename T>
  bool Plus(const T* x, const T* delta, T* sum) const {
    sum[0] = x[0] + delta[0];
    sum[1] = x[1] + delta[0];
    sum[2] = x[2] + delta[1];
    return true;
  }
  template <typename T>
  bool Minus(const T* y, const T* x, T* difference) const {
    difference[0] = 0.5 * (y[0] - x[0] + y[1] - x[1]);
    difference[1] = y[2] - x[2];
    return true;
  }
};

}  // namespace

PosedSuperquadric FitPlaceAndSize(std::span<const Eigen::Vector3d> p_map, const PosedSuperquadric& start,
                                  const FixedShapeFreedom& freedom) {
  if (p_map.empty()) {
    return start;
  }
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Vector3d log_size = start.shape.half_size.array().log();
  double yaw = 0.0;
  ceres::Problem problem;
  const Rigid3d T_object_map = start.T_map_object.Inverse();
  for (const Eigen::Vector3d& p : p_map) {
    problem.AddResidualBlock(
        new PointCost(T_object_map * p, start.shape, kNoise * start.shape.half_size.mean()),
        new ceres::HuberLoss(1.0), centre.data(), log_size.data(), &yaw);
  }
  problem.AddResidualBlock(
      new ceres::AutoDiffCostFunction<SidesCost, 6, 3, 3>(new SidesCost{start.shape.half_size}), nullptr,
      centre.data(), log_size.data());
  if (!freedom.yaw) {
    problem.SetParameterBlockConstant(&yaw);
  }
  if (freedom.round) {
    problem.SetManifold(log_size.data(), new ceres::AutoDiffManifold<EqualFirstTwo, 3, 2>);
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.logging_type = ceres::SILENT;
  options.num_threads = 1;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  PosedSuperquadric fitted = start;
  fitted.shape.half_size = log_size.array().exp();
  fitted.T_map_object.translation = start.T_map_object * centre;
  fitted.T_map_object.rotation =
      (start.T_map_object.rotation * Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ())).normalized();
  return fitted;
}

double MeanPointCost(std::span<const Eigen::Vector3d> p_map, const PosedSuperquadric& superquadric,
                     double size) {
  const SurfaceDistance distance(superquadric.shape);
  const Rigid3d T_object_map = superquadric.T_map_object.Inverse();
  double sum = 0.0;
  for (const Eigen::Vector3d& p : p_map) {
    const double d = std::abs(distance(T_object_map * p)) / (kNoise * size);
    sum += d <= 1.0 ? d * d : 2.0 * d - 1.0;
  }
  return p_map.empty() ? 0.0 : sum / static_cast<double>(p_map.size());
}

}  // namespace sqslam
