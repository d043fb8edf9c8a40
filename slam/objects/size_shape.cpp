#include "slam/objects/size_shape.h"

#include <ceres/tiny_solver.h>
#include <ceres/tiny_solver_autodiff_function.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "slam/objects/object_terms.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

// Robust weighted radial distances of points, and the prior, as functions of two angles: the exponents are
// those of ObjectSolid.
struct ShapeEnergy {
  std::span<const Eigen::Vector3d> p_object;
  Eigen::Vector3d half_size;
  std::vector<double> factors;  // sqrt(alpha) / mean half size
  SizeShapeOptions options;

  using Scalar = double;
  enum { NUM_RESIDUALS = Eigen::Dynamic, NUM_PARAMETERS = 2 };
  int NumResiduals() const { return static_cast<int>(p_object.size()) + 2; }

  template <typename T>
  bool operator()(const T* angles, T* residuals) const {
    const T exponents[2] = {ExponentOf(angles[0]), ExponentOf(angles[1])};
    for (std::size_t i = 0; i < p_object.size(); ++i) {
      const T distance = RadialDistance<T>(p_object[i].cast<T>(), half_size.cast<T>(), 2.0 / exponents[0],
                                           2.0 / exponents[1]);
      *residuals++ = Huber<T>(factors[i] * distance, options.huber);
    }
    const double factor =
        options.huber * std::sqrt(options.regularisation * static_cast<double>(p_object.size()));
    for (const T& exponent : exponents) {
      *residuals++ = factor * (exponent - options.prior_exponent);
    }
    return true;
  }

  // Signed square root of Huber's loss.
  template <typename T>
  static T Huber(const T& r, double width) {
    using std::abs;
    return abs(r) <= width ? r : SignedRoot<T>(2.0 * width * abs(r) - width * width, r, 1.0);
  }
};

ShapeFit BestOfGrid(const ShapeEnergy& energy) {
  const double step = energy.options.grid_step;
  const int steps = static_cast<int>((kMaxShapeExponent - kMinShapeExponent) / step + 1e-6);
  Eigen::VectorXd residuals(energy.NumResiduals());
  ShapeFit best;
  best.cost = std::numeric_limits<double>::infinity();
  for (int i = 0; i <= steps; ++i) {
    for (int j = 0; j <= steps; ++j) {
      const double e1 = kMinShapeExponent + i * step;
      const double e2 = kMinShapeExponent + j * step;
      energy(std::array{AngleOf(e1), AngleOf(e2)}.data(), residuals.data());
      if (residuals.squaredNorm() < best.cost) {
        best = {e1, e2, residuals.squaredNorm()};
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
  const std::vector<double> norms = ToVector(p_object, [](const Eigen::Vector3d& p) { return p.norm(); });
  if (norms.empty()) {
    return {};
  }
  const auto range = std::ranges::minmax(norms);
  return ToVector(norms, [&](double norm) {
    return range.max > range.min ? (norm - range.min) / (range.max - range.min) : 1.0;
  });
}

ShapeFit FitShape(std::span<const Eigen::Vector3d> p_object, const Eigen::Vector3d& half_size,
                  const SizeShapeOptions& options) {
  if (p_object.empty()) {
    return {options.prior_exponent, options.prior_exponent, 0.0};
  }
  ShapeEnergy energy{p_object, half_size, ShapeWeights(p_object), options};
  for (double& factor : energy.factors) {
    factor = std::sqrt(factor) / half_size.mean();
  }
  const ShapeFit start = BestOfGrid(energy);
  Eigen::Vector2d angles(AngleOf(start.e1), AngleOf(start.e2));
  using Derived = ceres::TinySolverAutoDiffFunction<ShapeEnergy, Eigen::Dynamic, 2>;
  ceres::TinySolver<Derived> solver{};
  solver.options.max_num_iterations = options.max_iterations;
  const double cost = 2.0 * solver.Solve(Derived(energy), &angles).final_cost;
  return {ExponentOf(angles[0]), ExponentOf(angles[1]), cost / static_cast<double>(p_object.size())};
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
