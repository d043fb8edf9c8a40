#pragma once

#include <ceres/sized_cost_function.h>

#include <array>
#include <cstdint>
#include <vector>

#include "slam/estimation/reprojection_cost.h"
#include "slam/geometry/rigid3.h"

namespace sqslam {

struct PoseGraphNode {
  std::int64_t id = -1;
  Sim3d S_camera_map;
  bool fixed = false;
};

// A measured relative pose of two nodes: S_j_i = S_j_map * S_i_map^-1.
struct PoseGraphEdge {
  std::int64_t i = -1;  // ids of nodes
  std::int64_t j = -1;
  Sim3d S_j_i;
  double weight = 1.0;  // of the squared residual
};

// Minimises the weighted sum of |Log(S_j_i * S_i_map * S_j_map^-1)|^2 over the edges (essential graph over
// Sim(3): Strasdat, Montiel, Davison, "Scale Drift-Aware Large Scale Monocular SLAM", RSS 2010). Fix at least
// one node, or the gauge (position, direction and scale) is undetermined. Results do not depend on memory
// addresses: they are bit-reproducible. Leaves the nodes unchanged if the solver fails.
void OptimizePoseGraph(std::vector<PoseGraphNode>& nodes, const std::vector<PoseGraphEdge>& edges);

// A similarity as a Ceres parameter block: quaternion x y z w, translation, logarithm of the scale.
using Sim3Block = std::array<double, 8>;

Sim3Block ToBlock(const Sim3d& S_camera_map);
Sim3d Sim3FromBlock(const double* block);

// Left perturbation S' = Exp(delta) S of a Sim3Block, delta as in lie.h.
class Sim3Manifold final : public PerturbationManifold {
 public:
  Sim3Manifold() : PerturbationManifold(8, 7) {}
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override;
  bool Minus(const double* y, const double* x, double* y_minus_x) const override;
};

// sqrt(weight) * Log(S_j_i * S_i_map * S_j_map^-1); parameters: node i, node j.
class RelativeSim3Cost final : public ceres::SizedCostFunction<7, 8, 8> {
 public:
  RelativeSim3Cost(const Sim3d& S_j_i, double weight);
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  Sim3d S_j_i_;
  double root_weight_;
};

}  // namespace sqslam
