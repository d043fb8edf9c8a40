#include "slam/estimation/pose_graph.h"

#include <gtest/gtest.h>

#include <cstring>
#include <numbers>
#include <random>
#include <stdexcept>

#include "slam/geometry/lie.h"

namespace sqslam {
namespace {

Vector7d RandomTangent(std::mt19937& random, double size) {
  std::normal_distribution<double> normal(0.0, size);
  Vector7d x;
  for (int i = 0; i < 7; ++i) {
    x[i] = normal(random);
  }
  return x;
}

TEST(Sim3Manifold, MinusUndoesPlus) {
  std::mt19937 random(1);
  const Sim3Manifold manifold;
  for (const double size : {1e-12, 1e-3, 0.4}) {  // of the step
    const Sim3Block x = ToBlock(ExpSim3(RandomTangent(random, 1.0)));
    const Vector7d delta = RandomTangent(random, size);
    Sim3Block y;
    ASSERT_TRUE(manifold.Plus(x.data(), delta.data(), y.data()));
    Vector7d found;
    ASSERT_TRUE(manifold.Minus(y.data(), x.data(), found.data()));
    EXPECT_LT((found - delta).norm(), 1e-14 + 1e-12 * delta.norm());
  }
}

TEST(Sim3Manifold, JacobiansUndoEachOther) {
  const Sim3Block x = ToBlock(Sim3d{});
  Eigen::Matrix<double, 8, 7, Eigen::RowMajor> plus;
  Eigen::Matrix<double, 7, 8, Eigen::RowMajor> minus;
  const Sim3Manifold manifold;
  manifold.PlusJacobian(x.data(), plus.data());
  manifold.MinusJacobian(x.data(), minus.data());
  EXPECT_TRUE((minus * plus).isIdentity());
}

// Central differences over the manifold's own Plus: the Jacobians that the solver sees.
TEST(RelativeSim3Cost, JacobiansAgreeWithNumericOnes) {
  std::mt19937 random(2);
  const Sim3Manifold manifold;
  constexpr double kStep = 1e-6;
  for (int round = 0; round < 20; ++round) {
    const Sim3d S_i = ExpSim3(RandomTangent(random, 0.7));
    const Sim3d S_j = ExpSim3(RandomTangent(random, 0.7));
    // Edges that fit exactly, nearly, and not at all.
    const Sim3d measured =
        ExpSim3(RandomTangent(random, round % 3 == 0 ? 0.0 : 0.3 * (round % 3))) * S_j * S_i.Inverse();
    const RelativeSim3Cost cost(measured, 2.0);
    const std::array<Sim3Block, 2> blocks{ToBlock(S_i), ToBlock(S_j)};
    std::array<Eigen::Matrix<double, 7, 8, Eigen::RowMajor>, 2> J;
    double* jacobians[] = {J[0].data(), J[1].data()};
    const double* parameters[] = {blocks[0].data(), blocks[1].data()};
    Vector7d residual;
    ASSERT_TRUE(cost.Evaluate(parameters, residual.data(), jacobians));
    for (std::size_t node = 0; node < 2; ++node) {
      for (int i = 0; i < 7; ++i) {
        const auto moved = [&](double step) {
          std::array<Sim3Block, 2> at = blocks;
          const Vector7d delta = step * Vector7d::Unit(i);
          manifold.Plus(blocks[node].data(), delta.data(), at[node].data());
          const double* where[] = {at[0].data(), at[1].data()};
          Vector7d value;
          EXPECT_TRUE(cost.Evaluate(where, value.data(), nullptr));
          return value;
        };
        const Vector7d numeric = (moved(kStep) - moved(-kStep)) / (2.0 * kStep);
        EXPECT_LT((numeric - J[node].col(i)).norm(), 1e-6 * (1.0 + numeric.norm()))
            << round << " " << node << " " << i;
      }
    }
  }
}

struct Ring {
  std::vector<Sim3d> truth;          // S_camera_map
  std::vector<PoseGraphNode> nodes;  // as odometry gives them; the first one fixed
  std::vector<PoseGraphEdge> edges;  // the odometry's
  PoseGraphEdge loop;                // from the last to the first, exact
};

// 40 cameras on a circle of radius 5 look inwards. Each step gains 1 % of scale and drifts in rotation (0.3
// degrees and a little noise) and translation.
Ring MakeRing() {
  constexpr int kCount = 40;
  std::mt19937 random(3);
  Ring ring;
  for (int k = 0; k < kCount; ++k) {
    const double angle = 2.0 * std::numbers::pi * k / kCount;
    const Eigen::Quaterniond rotation(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()));
    ring.truth.push_back(Sim3d::FromRigid(Rigid3d{rotation, rotation * Eigen::Vector3d(0, 0, -5)}.Inverse()));
  }
  ring.nodes.push_back({100, ring.truth[0], true});
  for (int k = 1; k < kCount; ++k) {
    const auto now = static_cast<std::size_t>(k);
    Vector7d drift = RandomTangent(random, 0.001);
    drift[1] += 0.005;
    drift[3] += 0.003;
    drift[6] = std::log(1.01);
    const Sim3d step = ExpSim3(drift) * ring.truth[now] * ring.truth[now - 1].Inverse();
    ring.nodes.push_back({100 + k, step * ring.nodes.back().S_camera_map, false});
    ring.edges.push_back({100 + k - 1, 100 + k, step, 1.0});
  }
  ring.loop = {100 + kCount - 1, 100, ring.truth.front() * ring.truth.back().Inverse(), 1.0};
  return ring;
}

// Root mean square distance of the camera centres to the true ones, in the frame of the first camera.
double CenterError(const Ring& ring) {
  double squared = 0.0;
  for (std::size_t i = 0; i < ring.nodes.size(); ++i) {
    squared += (ring.nodes[i].S_camera_map.Inverse().translation - ring.truth[i].Inverse().translation)
                   .squaredNorm();
  }
  return std::sqrt(squared / static_cast<double>(ring.nodes.size()));
}

TEST(OptimizePoseGraph, LoopEdgeRemovesDrift) {
  Ring ring = MakeRing();
  const double before = CenterError(ring);
  const double scale_before = ring.nodes.back().S_camera_map.scale;
  ring.edges.push_back(ring.loop);
  OptimizePoseGraph(ring.nodes, ring.edges);
  EXPECT_LT(CenterError(ring), before / 20.0) << "before: " << before;
  EXPECT_GT(scale_before, 1.4);
  EXPECT_NEAR(ring.nodes.back().S_camera_map.scale, 1.0, 0.02);
}

TEST(OptimizePoseGraph, KeepsNodesThatFitTheirEdges) {
  Ring ring = MakeRing();
  const std::vector<PoseGraphNode> before = ring.nodes;
  OptimizePoseGraph(ring.nodes, ring.edges);
  for (std::size_t i = 0; i < before.size(); ++i) {
    EXPECT_TRUE(ring.nodes[i].S_camera_map.Matrix().isApprox(before[i].S_camera_map.Matrix(), 1e-9));
  }
}

TEST(OptimizePoseGraph, CommutesWithSimilarityOfMapFrame) {
  Ring ring = MakeRing();
  ring.edges.push_back(ring.loop);
  Ring moved = ring;
  const Sim3d S_old_new{
      2.5, Eigen::Quaterniond(Eigen::AngleAxisd(1.0, Eigen::Vector3d(1, 2, 3).normalized())), {4, 5, -6}};
  for (PoseGraphNode& node : moved.nodes) {
    node.S_camera_map = node.S_camera_map * S_old_new;
  }
  OptimizePoseGraph(ring.nodes, ring.edges);
  OptimizePoseGraph(moved.nodes, moved.edges);
  for (std::size_t i = 0; i < ring.nodes.size(); ++i) {
    EXPECT_TRUE(moved.nodes[i].S_camera_map.Matrix().isApprox(
        (ring.nodes[i].S_camera_map * S_old_new).Matrix(), 1e-6));
  }
}

TEST(OptimizePoseGraph, KeepsFixedNodes) {
  Ring ring = MakeRing();
  ring.edges.push_back(ring.loop);
  ring.nodes[7].fixed = true;
  const std::vector<PoseGraphNode> before = ring.nodes;
  OptimizePoseGraph(ring.nodes, ring.edges);
  for (const std::size_t i : {0, 7}) {
    EXPECT_EQ(ring.nodes[i].S_camera_map.Matrix(), before[i].S_camera_map.Matrix());
  }
  EXPECT_FALSE(ring.nodes[8].S_camera_map.Matrix().isApprox(before[8].S_camera_map.Matrix(), 1e-6));
}

TEST(OptimizePoseGraph, RepeatsToTheLastBit) {
  Ring first = MakeRing();
  first.edges.push_back(first.loop);
  Ring second = first;
  OptimizePoseGraph(first.nodes, first.edges);
  const std::vector<double> in_between(12345);  // other addresses
  OptimizePoseGraph(second.nodes, second.edges);
  for (std::size_t i = 0; i < first.nodes.size(); ++i) {
    const Sim3Block a = ToBlock(first.nodes[i].S_camera_map);
    const Sim3Block b = ToBlock(second.nodes[i].S_camera_map);
    EXPECT_EQ(std::memcmp(a.data(), b.data(), sizeof(a)), 0);
  }
}

TEST(OptimizePoseGraph, RefusesEdgesToUnknownNodes) {
  Ring ring = MakeRing();
  EXPECT_THROW(OptimizePoseGraph(ring.nodes, {{100, 999, Sim3d{}, 1.0}}), std::out_of_range);
}

}  // namespace
}  // namespace sqslam
