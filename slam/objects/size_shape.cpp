#include "slam/objects/size_shape.h"

#include <ceres/ceres.h>
#include <ceres/normal_prior.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "slam/objects/object_solid.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

// Weighted radial distance of a point as a function of e1 and e2.
struct ShapeCost {
  Eigen::Vector3d half_size;
  Eigen::Vector3d p;
  double factor;  // sqrt(alpha) / mean half size

  template <typename T>
  bool operator()(const T* exponents, T* residual) const {
    residual[0] =
        factor * RadialDistance<T>(p.cast<T>(), half_size.cast<T>(), 2.0 / exponents[0], 2.0 / exponents[1]);
    return true;
  }
};

double HuberCost(double residual, double width) {
  const double r = std::abs(residual);
  return r <= width ? r * r : 2.0 * width * r - width * width;
}

// Mean robust cost at fixed exponents; the function that the refinement minimises.
double CostAt(const std::vector<ShapeCost>& costs, double e1, double e2, const SizeShapeOptions& options) {
  const double exponents[2] = {e1, e2};
  double sum = 0.0;
  for (const ShapeCost& cost : costs) {
    double residual = 0.0;
    cost(exponents, &residual);
    sum += HuberCost(residual, options.huber);
  }
  const double d1 = e1 - options.prior_exponent;
  const double d2 = e2 - options.prior_exponent;
  return sum / static_cast<double>(costs.size()) +
         options.regularisation * options.huber * options.huber * (d1 * d1 + d2 * d2);
}

ShapeFit BestOfGrid(const std::vector<ShapeCost>& costs, const SizeShapeOptions& options) {
  ShapeFit best;
  best.cost = std::numeric_limits<double>::infinity();
  const int steps = static_cast<int>((kMaxShapeExponent - kMinShapeExponent) / options.grid_step + 1e-6);
  for (int i = 0; i <= steps; ++i) {
    for (int j = 0; j <= steps; ++j) {
      const double e1 = kMinShapeExponent + i * options.grid_step;
      const double e2 = kMinShapeExponent + j * options.grid_step;
      const double cost = CostAt(costs, e1, e2, options);
      if (cost < best.cost) {
        best = {e1, e2, cost};
      }
    }
  }
  return best;
}

}  // namespace

Extents EstimateExtents(std::span<const Eigen::Vector3d> p_object, const SizeShapeOptions& options) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& p : p_object) {
    box.extend(p);
  }
  const Eigen::Vector3d half_size = 0.5 * box.sizes();
  const double thinnest = std::max(1e-9, options.thinnest_share * half_size.maxCoeff());
  return {0.5 * (box.min() + box.max()), half_size.cwiseMax(thinnest)};
}

std::vector<double> ShapeWeights(std::span<const Eigen::Vector3d> p_object) {
  double nearest = std::numeric_limits<double>::infinity();
  double farthest = 0.0;
  for (const Eigen::Vector3d& p : p_object) {
    nearest = std::min(nearest, p.norm());
    farthest = std::max(farthest, p.norm());
  }
  return ToVector(p_object, [&](const Eigen::Vector3d& p) {
    return farthest > nearest ? (p.norm() - nearest) / (farthest - nearest) : 1.0;
  });
}

ShapeFit FitShape(std::span<const Eigen::Vector3d> p_object, const Eigen::Vector3d& half_size,
                  const SizeShapeOptions& options) {
  if (p_object.empty()) {
    return {options.prior_exponent, options.prior_exponent, 0.0};
  }
  const std::vector<double> alpha = ShapeWeights(p_object);
  std::vector<ShapeCost> costs;
  for (std::size_t i = 0; i < p_object.size(); ++i) {
    costs.push_back({half_size, p_object[i], std::sqrt(alpha[i]) / half_size.mean()});
  }
  const ShapeFit start = BestOfGrid(costs, options);

  double exponents[2] = {start.e1, start.e2};
  const double factor =
      options.huber * std::sqrt(options.regularisation * static_cast<double>(p_object.size()));
  ceres::Problem problem;
  for (const ShapeCost& cost : costs) {
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<ShapeCost, 1, 2>(new ShapeCost(cost)),
                             new ceres::HuberLoss(options.huber), exponents);
  }
  problem.AddResidualBlock(new ceres::NormalPrior(factor * ceres::Matrix::Identity(2, 2),
                                                  ceres::Vector::Constant(2, options.prior_exponent)),
                           nullptr, exponents);
  for (int i = 0; i < 2; ++i) {
    problem.SetParameterLowerBound(exponents, i, kMinShapeExponent);
    problem.SetParameterUpperBound(exponents, i, kMaxShapeExponent);
  }
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::DENSE_QR;
  solver.max_num_iterations = options.max_iterations;
  solver.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);
  const ShapeFit refined{exponents[0], exponents[1], CostAt(costs, exponents[0], exponents[1], options)};
  return refined.cost <= start.cost ? refined : start;
}

PosedSuperquadric SuperquadricAtYaw(std::span<const Eigen::Vector3d> p_map, double yaw,
                                    const SizeShapeOptions& options, bool with_shape) {
  const Eigen::Quaterniond R_map_object(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()));
  std::vector<Eigen::Vector3d> turned = ToVector(
      p_map, [&](const Eigen::Vector3d& p) -> Eigen::Vector3d { return R_map_object.conjugate() * p; });
  Extents extents = EstimateExtents(turned, options);
  if (options.centre == CloudCentre::kCentroid && !turned.empty()) {
    extents.centre =
        Eigen::Map<const Eigen::Matrix3Xd>(turned.front().data(), 3, static_cast<Eigen::Index>(turned.size()))
            .rowwise()
            .mean();
  }
  for (Eigen::Vector3d& p : turned) {
    p -= extents.centre;
  }
  const ShapeFit fit = with_shape ? FitShape(turned, extents.half_size, options) : ShapeFit();
  PosedSuperquadric result;
  result.shape = {extents.half_size, fit.e1, fit.e2};
  result.T_map_object = {R_map_object, R_map_object * extents.centre};
  return result;
}

}  // namespace sqslam
