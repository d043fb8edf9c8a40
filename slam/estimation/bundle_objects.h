#pragma once

#include <ceres/ceres.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "slam/estimation/bundle_adjustment.h"
#include "slam/geometry/radial_distance.h"
#include "slam/geometry/superquadric.h"

namespace sqslam {

// A posed superquadric as a Ceres parameter block: centre (map frame), logarithms of the half sizes, rotation
// about its own z axis since the block was made (radians), e1, e2.
using SuperquadricBlock = std::array<double, 9>;

inline constexpr int kBlockLogHalf = 3;
inline constexpr int kBlockTurn = 6;
inline constexpr int kBlockExponents = 7;

// Returns the block of a superquadric, with a rotation of zero.
SuperquadricBlock ToBlock(const PosedSuperquadric& superquadric);

// `R_map_start`: the rotation of the superquadric that the block was made of.
PosedSuperquadric FromBlock(const SuperquadricBlock& block, const Eigen::Quaterniond& R_map_start);

// The shape error of the joint optimisation (section "Size And Shape"): sqrt(alpha) G(Lambda, p) / sigma with
// G the radial Euclidean distance (signed here; its square is the same). Parameters: SuperquadricBlock, point
// in the map frame. The second residual is zero: with the row size of the reprojection error, Ceres
// eliminates the points with code for fixed sizes.
struct SurfaceCost {
  Eigen::Matrix3d R_start_map;
  double factor;  // sqrt(alpha) / sigma, 1 / map units

  template <typename T>
  bool operator()(const T* block, const T* p_map, T* residuals) const {
    using std::cos, std::exp, std::sin;
    const Vector3<T> offset(p_map[0] - block[0], p_map[1] - block[1], p_map[2] - block[2]);
    const Vector3<T> p = R_start_map.cast<T>() * offset;
    const T c = cos(block[kBlockTurn]);
    const T s = sin(block[kBlockTurn]);
    const T* log_half = block + kBlockLogHalf;
    const T* exponents = block + kBlockExponents;
    residuals[0] = factor * RadialDistance<T>({c * p.x() + s * p.y(), c * p.y() - s * p.x(), p.z()},
                                              {exp(log_half[0]), exp(log_half[1]), exp(log_half[2])},
                                              2.0 / exponents[0], 2.0 / exponents[1]);
    residuals[1] = T(0.0);
    return true;
  }
};

// Returns the robust sum of squared shape errors of an object at the current points of the problem.
double ShapeCost(const BundleObject& object, const BundleProblem& problem);

// The objects' part of a running bundle adjustment. Owns their parameter blocks, so it must outlive every
// ceres::Problem that it was added to.
class ObjectBlocks {
 public:
  explicit ObjectBlocks(BundleProblem& problem);

  // The points' blocks must be in `solver` already and stay in elimination group 0. Superquadrics get a group
  // of their own, after the cameras (group 1): within a group Ceres orders by address, and the order of two
  // vectors in memory differs from run to run.
  void AddTo(ceres::Problem& solver, ceres::ParameterBlockOrdering& ordering);

  void Read();  // copies the blocks into the problem

  // Keeps each superquadric that fits the points better than its start, and restores the others.
  void KeepImprovements();

 private:
  void AddResiduals(std::size_t object, ceres::Problem& solver, ceres::ParameterBlockOrdering& ordering);

  BundleProblem& problem_;
  std::vector<PosedSuperquadric> starts_;
  std::vector<SuperquadricBlock> blocks_;
  std::vector<std::unique_ptr<ceres::LossFunction>> losses_;
};

}  // namespace sqslam
