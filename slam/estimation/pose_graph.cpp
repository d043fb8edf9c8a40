#include "slam/estimation/pose_graph.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>
#include <string>

#include "slam/geometry/lie.h"

namespace sqslam {
namespace {

std::map<std::int64_t, std::size_t> IndexById(const std::vector<PoseGraphNode>& nodes) {
  std::map<std::int64_t, std::size_t> index;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (!index.emplace(nodes[i].id, i).second) {
      throw std::invalid_argument("pose graph: node " + std::to_string(nodes[i].id) + " is given twice");
    }
  }
  return index;
}

std::size_t Find(const std::map<std::int64_t, std::size_t>& index, std::int64_t id) {
  const auto found = index.find(id);
  if (found == index.end()) {
    throw std::invalid_argument("pose graph: an edge names node " + std::to_string(id) +
                                ", which is not given");
  }
  return found->second;
}

}  // namespace

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
  Vector7d tangent = Vector7d::Zero();
  std::copy_n(delta, TangentSize(), tangent.data());
  Sim3Block moved = ToBlock(ExpSim3(tangent) * Sim3FromBlock(x));
  moved[7] = x[7] + tangent[6];  // exact: a fixed scale does not change by a bit
  std::ranges::copy(moved, x_plus_delta);
  return true;
}

bool Sim3Manifold::Minus(const double* y, const double* x, double* y_minus_x) const {
  const Vector7d difference = LogSim3(Sim3FromBlock(y) * Sim3FromBlock(x).Inverse());
  std::copy_n(difference.data(), TangentSize(), y_minus_x);
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

PoseGraphReport OptimizePoseGraph(std::vector<PoseGraphNode>& nodes, const std::vector<PoseGraphEdge>& edges,
                                  const PoseGraphOptions& options) {
  const std::map<std::int64_t, std::size_t> index = IndexById(nodes);
  std::vector<Sim3Block> blocks;  // contiguous, because Ceres orders parameter blocks by address
  for (const PoseGraphNode& node : nodes) {
    blocks.push_back(ToBlock(node.S_camera_map));
  }
  ceres::Problem::Options problem_options;
  problem_options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  problem_options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::HuberLoss huber(options.huber > 0.0 ? options.huber : 1.0);
  Sim3Manifold manifold(options.fix_scale);
  ceres::Problem problem(problem_options);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    problem.AddParameterBlock(blocks[i].data(), 8, &manifold);
    if (nodes[i].fixed) {
      problem.SetParameterBlockConstant(blocks[i].data());
    }
  }
  for (const PoseGraphEdge& edge : edges) {
    problem.AddResidualBlock(new RelativeSim3Cost(edge.S_j_i, edge.weight),
                             options.huber > 0.0 ? &huber : nullptr, blocks[Find(index, edge.i)].data(),
                             blocks[Find(index, edge.j)].data());
  }
  ceres::Solver::Options solver_options;
  solver_options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  solver_options.max_num_iterations = options.iterations;
  solver_options.num_threads = options.threads;
  solver_options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(solver_options, &problem, &summary);
  const bool usable = summary.IsSolutionUsable();
  for (std::size_t i = 0; usable && i < nodes.size(); ++i) {
    if (!nodes[i].fixed) {
      const double scale = nodes[i].S_camera_map.scale;
      nodes[i].S_camera_map = Sim3FromBlock(blocks[i].data());
      nodes[i].S_camera_map.scale = options.fix_scale ? scale : nodes[i].S_camera_map.scale;
    }
  }
  return {summary.initial_cost, summary.final_cost, static_cast<int>(summary.iterations.size()) - 1, usable};
}

}  // namespace sqslam
