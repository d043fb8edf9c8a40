#include "slam/objects/object_energy.h"

#include <ceres/tiny_solver.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "slam/geometry/angles.h"

namespace sqslam {
namespace {

constexpr int kCount = parameter::kCount;
using Square = Eigen::Matrix<double, kCount, kCount>;

// Residuals and Jacobian of an energy, for ceres::TinySolver, which evaluates each accepted step first for
// its cost and then for its derivatives: both come from one evaluation.
template <int kRows>
class DerivedEnergy {
 public:
  using Scalar = double;
  enum { NUM_RESIDUALS = Eigen::Dynamic, NUM_PARAMETERS = kRows };
  using Parameters = Eigen::Matrix<double, kRows, 1>;

  explicit DerivedEnergy(const ObjectEnergy& energy)
      : energy_(energy), residuals_(static_cast<std::size_t>(energy.NumResiduals())) {}

  int NumResiduals() const { return static_cast<int>(residuals_.size()); }

  // `jacobian`: column-major, NumResiduals() x kRows; may be null.
  bool operator()(const double* parameters, double* residuals, double* jacobian) const {
    const Parameters x = Eigen::Map<const Parameters>(parameters);
    if (!evaluated_ || x != x_) {
      Eigen::Matrix<Jet, kRows, 1> jets;
      for (int i = 0; i < kRows; ++i) {
        jets[i] = Jet(x[i], i);
      }
      energy_(jets.data(), residuals_.data());
      x_ = x;
      evaluated_ = true;
    }
    Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, kRows>> J(jacobian, NumResiduals(), kRows);
    for (int row = 0; row < NumResiduals(); ++row) {
      const Jet& residual = residuals_[static_cast<std::size_t>(row)];
      residuals[row] = residual.a;
      if (jacobian != nullptr) {
        J.row(row) = residual.v;
      }
    }
    return true;
  }

 private:
  using Jet = ceres::Jet<double, kRows>;
  const ObjectEnergy& energy_;
  mutable bool evaluated_ = false;
  mutable Parameters x_;
  mutable std::vector<Jet> residuals_;
};

Square Information(const Eigen::Matrix<double, Eigen::Dynamic, kCount>& jacobian, Eigen::Index rows) {
  constexpr double kWeakest = 1e-6;  // for unobserved directions
  Square information = jacobian.topRows(rows).transpose() * jacobian.topRows(rows);
  information.diagonal() = information.diagonal().cwiseMax(kWeakest);
  information.diagonal() *= 1.0 + 1e-9;
  return information;
}

// Half the log determinant of the information on centre, size, yaw and tapers. Exponents and biases are left
// out, as their priors are alike for all kinds of shape; an unobserved yaw still lies within a quarter turn,
// that of a handle within a whole one.
double HalfLogDeterminant(Square information, bool handled) {
  constexpr std::array<int, 9> kKept = {
      0, 1, 2, 3, 4, 5, parameter::kYaw, parameter::kTaper, parameter::kTaper + 1};
  constexpr std::array<int, 6> kOthers = {parameter::kExponents, parameter::kExponents + 1,
                                          parameter::kBias,      parameter::kBias + 1,
                                          parameter::kBias + 2,  parameter::kBias + 3};
  const double yaw_sigma = (handled ? 4.0 : 1.0) * 0.4534;  // the range over the square root of 12
  information(parameter::kYaw, parameter::kYaw) += 1.0 / (yaw_sigma * yaw_sigma);
  const Eigen::Matrix<double, 6, 6> others = information(kOthers, kOthers);
  const Eigen::Matrix<double, 6, 9> across = information(kOthers, kKept);
  const Eigen::Matrix<double, 9, 9> kept =
      information(kKept, kKept) - across.transpose() * others.ldlt().solve(across);
  return 0.5 * kept.ldlt().vectorD().array().max(1e-12).log().sum();
}

}  // namespace

double ObjectEnergy::Cost(const SolidParameters& x) const {
  Eigen::VectorXd residuals(NumResiduals());
  (*this)(x.data(), residuals.data());
  return 0.5 * residuals.squaredNorm();
}

template <int kRows>
double Minimise(const ObjectEnergy& energy, int max_iterations, double cost_tolerance,
                Eigen::Matrix<double, kRows, 1>& x) {
  ceres::TinySolver<DerivedEnergy<kRows>> solver;
  solver.options.max_num_iterations = max_iterations;
  solver.options.function_tolerance = cost_tolerance;
  return solver.Solve(DerivedEnergy<kRows>(energy), &x).final_cost;
}
template double Minimise(const ObjectEnergy&, int, double, Eigen::Matrix<double, parameter::kCount, 1>&);
template double Minimise(const ObjectEnergy&, int, double,
                         Eigen::Matrix<double, parameter::kMovingCount, 1>&);

ObjectUncertainty UncertaintyAt(const SolidParameters& x, const ObjectEnergy& energy) {
  const int rows = energy.NumResiduals();
  Eigen::VectorXd residuals(rows);
  Eigen::Matrix<double, Eigen::Dynamic, kCount> jacobian(rows, kCount);
  // The bound of the tapers is no measurement: it must not count as information.
  SolidParameters inside = x;
  inside.segment<2>(parameter::kTaper) = inside.segment<2>(parameter::kTaper).cwiseMin(0.0);
  const DerivedEnergy<kCount> derived(energy);
  derived(inside.data(), residuals.data(), jacobian.data());
  const Square measured = Information(jacobian, rows - static_cast<Eigen::Index>(energy.bounds.size()));
  // Chain rule to sizes and exponents: d half = half d log(half), d e = reach cos(u) du.
  Eigen::Matrix<double, 9, 1> slope = Eigen::Matrix<double, 9, 1>::Ones();
  slope.segment<3>(parameter::kLogHalf) = x.segment<3>(parameter::kLogHalf).array().exp();
  slope.segment<2>(parameter::kExponents) =
      kExponentReach * x.segment<2>(parameter::kExponents).array().cos();
  const Square covariance = measured.ldlt().solve(Square::Identity());
  double taper_factors = 0.0;
  for (const NormalTerm& term : energy.normals) {
    taper_factors += term.index >= parameter::kTaper ? std::log(term.factor) : 0.0;
  }
  return {slope.asDiagonal() * covariance.topLeftCorner<9, 9>() * slope.asDiagonal(),
          HalfLogDeterminant(Information(jacobian, rows), energy.variant.handled) - taper_factors};
}

SolidParameters PackSolid(const PosedSuperquadric& superquadric) {
  const auto& [shape, T_map_object] = superquadric;
  const auto angle = [](double e) {
    constexpr double kInside = 0.999;
    return std::asin(std::clamp((e - kExponentMiddle) / kExponentReach, -kInside, kInside));
  };
  SolidParameters x = SolidParameters::Zero();
  x.head<3>() = T_map_object.translation;
  x.segment<3>(parameter::kLogHalf) = shape.half_size.array().log();
  x[parameter::kYaw] = YawOf(T_map_object.rotation);
  x.segment<2>(parameter::kExponents) << angle(shape.e1), angle(shape.e2);
  return x;
}

PosedSuperquadric UnpackSolid(const SolidParameters& x) {
  const ObjectSolid<double> solid(x.data(), {});
  return {
      {solid.hull, solid.e1, solid.e2},
      {Eigen::Quaterniond(Eigen::AngleAxisd(x[parameter::kYaw], Eigen::Vector3d::UnitZ())), solid.centre}};
}

}  // namespace sqslam
