#include "slam/estimation/pose_graph.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "slam/geometry/lie.h"

namespace sqslam {
Sim3Block ToBlock(const Sim3d& S_camera_map) {
  const auto& q = S_camera_map.rotation;
  const auto& t = S_camera_map.translation;
  return {q.x(), q.y(), q.z(), q.w(), t.x(), t.y(), t.z(), std::log(S_camera_map.scale)};
}

Sim3d Sim3FromBlock(const double* block) {
  return {std::exp(block[7]), Eigen::Quaterniond(block[3], block[0], block[1], block[2]).normalized(),
          Eigen::Vector3d(block[4], block[5], block[6])};
}

bool Sim3Manifold::Plus(const double* x, const double* delta, double* x_plus_delta) const {
  const Eigen::Map<const Vector7d> tangent(delta);
  Sim3Block moved = ToBlock(ExpSim3(tangent) * Sim3FromBlock(x));
  moved[7] = x[7] + tangent[6];  // more precise than the logarithm of the scale
  std::ranges::copy(moved, x_plus_delta);
  return true;
}

bool Sim3Manifold::Minus(const double* y, const double* x, double* y_minus_x) const {
  Eigen::Map<Vector7d> difference(y_minus_x);
  difference = LogSim3(Sim3FromBlock(y) * Sim3FromBlock(x).Inverse());
  return true;
}

RelativeSim3Cost::RelativeSim3Cost(const Sim3d& S_j_i, double weight)
    : S_j_i_(S_j_i), root_weight_(std::sqrt(weight)) {}

bool RelativeSim3Cost::Evaluate(double const* const* parameters, double* residuals,
                                double** jacobians) const {
  const Sim3d error = S_j_i_ * Sim3FromBlock(parameters[0]) * Sim3FromBlock(parameters[1]).Inverse();
  const Vector7d log = LogSim3(error);
  Eigen::Map<Vector7d> residual(residuals);
  residual = root_weight_ * log;
  if (jacobians == nullptr) {
    return true;
  }
  // Log(Exp(x) error) = Log(error) + J^-1 x to first order, with J the left Jacobian at Log(error).
  const Matrix7d inverse = root_weight_ * LeftJacobianSim3(log).inverse();
  const auto write = [](double* jacobian, const auto& by_tangent) {
    if (jacobian != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 7, 8, Eigen::RowMajor>> J(jacobian);
      J.leftCols<7>().noalias() = by_tangent;
      J.col(7).setZero();
    }
  };
  write(jacobians[0], inverse * AdjointSim3(S_j_i_));
  write(jacobians[1], -inverse * AdjointSim3(error));
  return true;
}

void OptimizePoseGraph(std::vector<PoseGraphNode>& nodes, const std::vector<PoseGraphEdge>& edges) {
  constexpr int kIterations = 20;
  std::map<std::int64_t, std::size_t> index;
  std::vector<Sim3Block> blocks;  // contiguous, because Ceres orders parameter blocks by address
  for (const PoseGraphNode& node : nodes) {
    index[node.id] = blocks.size();
    blocks.push_back(ToBlock(node.S_camera_map));
  }
  ceres::Problem::Options problem_options;
  problem_options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  Sim3Manifold manifold;
  ceres::Problem problem(problem_options);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    problem.AddParameterBlock(blocks[i].data(), 8, &manifold);
    if (nodes[i].fixed) {
      problem.SetParameterBlockConstant(blocks[i].data());
    }
  }
  for (const PoseGraphEdge& edge : edges) {
    problem.AddResidualBlock(new RelativeSim3Cost(edge.S_j_i, edge.weight), nullptr,
                             blocks[index.at(edge.i)].data(), blocks[index.at(edge.j)].data());
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.max_num_iterations = kIterations;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  for (std::size_t i = 0; summary.IsSolutionUsable() && i < nodes.size(); ++i) {
    if (!nodes[i].fixed) {
      nodes[i].S_camera_map = Sim3FromBlock(blocks[i].data());
    }
  }
}

}  // namespace sqslam
