#include "slam/objects/object_energy.h"

#include <ceres/tiny_solver.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "slam/geometry/angles.h"
#include "slam/objects/edge_noise.h"
#include "slam/objects/landmark_geometry.h"
#include "slam/objects/visibility.h"

namespace sqslam {
namespace {

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

template <int kRows>
Eigen::Matrix<double, kRows, kRows> Information(const Eigen::Matrix<double, Eigen::Dynamic, kRows>& jacobian,
                                                Eigen::Index rows) {
  constexpr double kWeakest = 1e-6;  // for unobserved directions
  Eigen::Matrix<double, kRows, kRows> information =
      jacobian.topRows(rows).transpose() * jacobian.topRows(rows);
  information.diagonal() = information.diagonal().cwiseMax(kWeakest);
  information.diagonal() *= 1.0 + 1e-9;
  return information;
}

}  // namespace

void ObjectEnergy::AddEdges(const SilhouetteView& view, const Camera& camera,
                            const RefinementOptions& options) {
  const Eigen::Matrix3d R = view.T_map_camera.RotationMatrix();
  const Box2d& box = view.box;
  const std::array<double, 4> at = NormalisedBounds(box, camera);
  const bool whole = IsWhole(view.edge_exact);
  for (std::size_t edge = 0; edge < 4; ++edge) {
    const int axis = static_cast<int>(edge % 2);
    const double outward = edge < 2 ? -1.0 : 1.0;
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    normal[axis] = outward;
    normal[2] = -outward * at[edge];
    const double sigma = EdgeSigma(axis == 0 ? box.width : box.height, options);
    edges.push_back({R * normal, view.T_map_camera.translation, R.col(2),
                     (axis == 0 ? camera.fx : camera.fy) / sigma, static_cast<int>(edge),
                     (axis == 0 ? box.width : box.height) / sigma, view.edge_exact[edge], whole, view.time});
  }
}

void ObjectEnergy::AddProportions(const SizePrior& known, int longer) {
  const double log_ratio = longer == 0 ? known.log_width_ratio : -known.log_width_ratio;
  classes.push_back({kWidthRatio, log_ratio, 1.0 / known.width_sigma});
  classes.push_back({{-0.5, -0.5, 1.0}, known.log_height_ratio, 1.0 / known.height_sigma});
}

double ObjectEnergy::Cost(const Eigen::Ref<const Eigen::VectorXd>& x) const {
  Eigen::VectorXd residuals(NumResiduals());
  (*this)(x.data(), residuals.data());
  return 0.5 * residuals.squaredNorm();
}

double ObjectEnergy::LogNormaliser() const {
  double sum = yaws.empty() ? std::log(kYawRange) : 0.0;
  const auto add = [&](const auto& priors) {
    for (const auto& prior : priors) {
      sum += prior.LogNormaliser();
    }
  };
  add(contacts);
  add(classes);
  add(exponents);
  add(yaws);
  add(normals);
  return sum;
}

template <int kRows>
double Minimise(const ObjectEnergy& energy, int max_iterations, double cost_tolerance,
                Eigen::Matrix<double, kRows, 1>& x) {
  ceres::TinySolver<DerivedEnergy<kRows>> solver;
  solver.options.max_num_iterations = max_iterations;
  solver.options.function_tolerance = cost_tolerance;
  return solver.Solve(DerivedEnergy<kRows>(energy), &x).final_cost;
}
template double Minimise(const ObjectEnergy&, int, double, SolidParameters&);
template double Minimise(const ObjectEnergy&, int, double, AllParameters&);

template <int kRows>
ObjectEvidence EvidenceAt(const Eigen::Matrix<double, kRows, 1>& minimum, const ObjectEnergy& energy) {
  using Square = Eigen::Matrix<double, kRows, kRows>;
  const int rows = energy.NumResiduals();
  Eigen::VectorXd residuals(rows);
  Eigen::Matrix<double, Eigen::Dynamic, kRows> jacobian(rows, kRows);
  // The bound of the tapers is no measurement: it must not count as information. At those of the exponents
  // the sine has no slope.
  Eigen::Matrix<double, kRows, 1> x = minimum;
  x.template segment<2>(parameter::kTaper) = x.template segment<2>(parameter::kTaper).cwiseMin(0.0);
  for (double& angle : x.template segment<2>(parameter::kExponents)) {
    angle = AngleOf(ExponentOf(angle));
  }
  const DerivedEnergy<kRows> derived(energy);
  derived(x.data(), residuals.data(), jacobian.data());
  // Chain rule to sizes and exponents: d half = half d log(half), d e = reach cos(u) du.
  const Eigen::Array2d by_u =
      (kExponentReach * x.template segment<2>(parameter::kExponents).array().cos()).max(1e-3);
  Eigen::Matrix<double, 9, 1> slope = Eigen::Matrix<double, 9, 1>::Ones();
  slope.segment<3>(parameter::kLogHalf) = x.template segment<3>(parameter::kLogHalf).array().exp();
  slope.segment<2>(parameter::kExponents) = by_u;
  Eigen::Matrix<double, Eigen::Dynamic, kRows> weighted = jacobian;
  weighted.topRows(static_cast<Eigen::Index>(energy.edges.size())) *= std::sqrt(energy.edge_information);
  const Square covariance = Information(weighted, rows - static_cast<Eigen::Index>(energy.bounds.size()))
                                .ldlt()
                                .solve(Square::Identity());
  Square information = Information(jacobian, rows);
  information(parameter::kYaw, parameter::kYaw) += 12.0 / (ObjectEnergy::kYawRange * ObjectEnergy::kYawRange);
  const double half_log_information =
      0.5 * information.ldlt().vectorD().array().max(1e-12).log().sum() - by_u.log().sum();
  return {0.5 * residuals.squaredNorm() + energy.LogNormaliser() + half_log_information -
              kRows * LogGaussianIntegral(1.0),
          slope.asDiagonal() * covariance.template topLeftCorner<9, 9>() * slope.asDiagonal()};
}

template ObjectEvidence EvidenceAt(const SolidParameters&, const ObjectEnergy&);
template ObjectEvidence EvidenceAt(const AllParameters&, const ObjectEnergy&);

SolidParameters PackSolid(const PosedSuperquadric& superquadric) {
  const auto& [shape, T_map_object] = superquadric;
  SolidParameters x = SolidParameters::Zero();
  x.head<3>() = T_map_object.translation;
  x.segment<3>(parameter::kLogHalf) = shape.half_size.array().log();
  x[parameter::kYaw] = YawOf(T_map_object.rotation);
  x.segment<2>(parameter::kExponents) << AngleOf(shape.e1), AngleOf(shape.e2);
  return x;
}

PosedSuperquadric UnpackSolid(const SolidParameters& x) {
  const ObjectSolid<double> solid(x.data(), {});
  return {
      {solid.hull, solid.e1, solid.e2},
      {Eigen::Quaterniond(Eigen::AngleAxisd(x[parameter::kYaw], Eigen::Vector3d::UnitZ())), solid.centre}};
}

std::vector<SolidPart> UnpackParts(const AllParameters& x, const SolidVariant& variant) {
  const ObjectSolid<double> solid(x.data(), variant);
  std::vector<SolidPart> parts;
  for (std::size_t i = 0; i < solid.num_parts; ++i) {
    const ObjectSolid<double>::Part& part = solid.parts[i];
    parts.push_back({part.centre.cwiseQuotient(solid.hull),
                     {part.half.cwiseQuotient(solid.hull), 2.0 / part.p1, 2.0 / part.p2}});
  }
  return parts;
}

}  // namespace sqslam
