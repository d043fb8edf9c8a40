#include "slam/fitting/fixed_shape_fit.h"

#include <ceres/ceres.h>

#include <cmath>

#include "slam/fitting/surface_measures.h"

namespace sqslam {
namespace {

constexpr double kNoise = 0.05;  // of the mean half size
constexpr double kPull = 0.1;    // of each half size

// Half sizes by their logarithms; of a round thing the second is that along x.
template <typename T>
Eigen::Matrix<T, 3, 1> HalfSize(const T* log_size, bool round) {
  using std::exp;
  return {exp(log_size[0]), exp(log_size[round ? 0 : 1]), exp(log_size[2])};
}

// Distance of a point over the noise. Parameters: centre (in the frame of `start`), logarithms of the half
// sizes, rotation about the z axis.
struct PointCost {
  Eigen::Vector3d p;
  Superquadric shape;
  double noise;
  bool round;

  template <typename T>
  bool operator()(const T* centre, const T* log_size, const T* yaw, T* residual) const {
    using Vector = Eigen::Matrix<T, 3, 1>;
    const Vector offset = p.cast<T>() - Eigen::Map<const Vector>(centre);
    const T c = cos(*yaw);
    const T s = sin(*yaw);
    const SurfaceDistanceOf<T> distance(HalfSize(log_size, round), T(shape.e1), T(shape.e2));
    *residual =
        distance({c * offset.x() + s * offset.y(), c * offset.y() - s * offset.x(), offset.z()}) / noise;
    return true;
  }
};

// Prior on the six sides (centre minus and plus half size), with a standard deviation of kPull of the half
// size. Priors on centre and size instead would let a shape seen from above shrink to its visible part.
struct SidesCost {
  Eigen::Vector3d start;  // half sizes
  bool round;

  template <typename T>
  bool operator()(const T* centre, const T* log_size, T* residuals) const {
    const Eigen::Matrix<T, 3, 1> half = HalfSize(log_size, round);
    for (int i = 0; i < 3; ++i) {
      residuals[2 * i] = (centre[i] - half[i] + start[i]) / (kPull * start[i]);
      residuals[2 * i + 1] = (centre[i] + half[i] - start[i]) / (kPull * start[i]);
    }
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
        new ceres::AutoDiffCostFunction<PointCost, 1, 3, 3, 1>(new PointCost{
            T_object_map * p, start.shape, kNoise * start.shape.half_size.mean(), freedom.round}),
        new ceres::HuberLoss(1.0), centre.data(), log_size.data(), &yaw);
  }
  problem.AddResidualBlock(new ceres::AutoDiffCostFunction<SidesCost, 6, 3, 3>(
                               new SidesCost{start.shape.half_size, freedom.round}),
                           nullptr, centre.data(), log_size.data());
  if (!freedom.yaw) {
    problem.SetParameterBlockConstant(&yaw);
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.logging_type = ceres::SILENT;
  options.num_threads = 1;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  PosedSuperquadric fitted = start;
  fitted.shape.half_size = HalfSize(log_size.data(), freedom.round);
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
