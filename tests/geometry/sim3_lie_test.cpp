#include <gtest/gtest.h>

#include <random>
#include <unsupported/Eigen/MatrixFunctions>

#include "slam/geometry/lie.h"

namespace sqslam {
namespace {

// Rotation up to `angle` radians, translation parts of the order of `translation`, log-scales of `sigma`.
Vector7d RandomTangent(std::mt19937& random, double angle, double translation, double sigma) {
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  Vector7d x;
  for (int i = 0; i < 7; ++i) {
    x[i] = uniform(random);
  }
  x.head<3>() *= angle * std::abs(uniform(random)) / x.head<3>().norm();
  x.segment<3>(3) *= translation;
  x[6] *= sigma;
  return x;
}

std::vector<Vector7d> Tangents() {
  std::mt19937 random(3);
  std::vector<Vector7d> tangents{Vector7d::Zero()};
  const std::vector<double> sizes{0.0, 1e-300, 1e-16, 1e-9, 1e-7, 1e-5, 1e-3, 0.1, 0.299, 0.301, 1.0, 3.1};
  for (const double angle : sizes) {
    for (const double sigma : sizes) {
      for (const double translation : {1e-9, 1.0, 100.0}) {
        tangents.push_back(RandomTangent(random, angle, translation, sigma));
      }
    }
  }
  return tangents;
}

TEST(Sim3Lie, ExpAgreesWithMatrixExponential) {
  for (const Vector7d& x : Tangents()) {
    Eigen::Matrix4d generator = Eigen::Matrix4d::Zero();
    generator.topLeftCorner<3, 3>() = Skew(x.head<3>()) + x[6] * Eigen::Matrix3d::Identity();
    generator.topRightCorner<3, 1>() = x.segment<3>(3);
    const Eigen::Matrix4d expected = generator.exp();
    const Eigen::Matrix4d found = ExpSim3(x).Matrix();
    EXPECT_LT((found - expected).norm(), 1e-13 * (1.0 + expected.norm())) << x.transpose();
  }
}

TEST(Sim3Lie, LogInvertsExp) {
  for (const Vector7d& x : Tangents()) {
    const Vector7d found = LogSim3(ExpSim3(x));
    EXPECT_LT((found.head<3>() - x.head<3>()).norm(), 1e-13 * (1.0 + 10.0 * x.head<3>().norm()))
        << x.transpose();
    EXPECT_LE((found.segment<3>(3) - x.segment<3>(3)).norm(), 1e-12 * x.segment<3>(3).norm())
        << x.transpose();
    EXPECT_NEAR(found[6], x[6], 1e-15 + 1e-14 * std::abs(x[6]));
  }
}

TEST(Sim3Lie, ExpInvertsLogForBothQuaternionSigns) {
  const Sim3d S{
      0.5, Eigen::Quaterniond(Eigen::AngleAxisd(3.0, Eigen::Vector3d(1, -2, 2).normalized())), {3, -4, 5}};
  const Sim3d same{0.5, Eigen::Quaterniond(-S.rotation.coeffs()), S.translation};
  EXPECT_TRUE(ExpSim3(LogSim3(S)).Matrix().isApprox(S.Matrix(), 1e-12));
  EXPECT_TRUE(LogSim3(same).isApprox(LogSim3(S), 1e-12));
}

TEST(Sim3Lie, AdjointMovesTangentsThroughProduct) {
  std::mt19937 random(5);
  for (int i = 0; i < 20; ++i) {
    const Sim3d S = ExpSim3(RandomTangent(random, 3.0, 4.0, 1.0));
    const Vector7d x = RandomTangent(random, 0.5, 0.5, 0.5);
    const Sim3d left = S * ExpSim3(x) * S.Inverse();
    EXPECT_TRUE(left.Matrix().isApprox(ExpSim3(AdjointSim3(S) * x).Matrix(), 1e-10));
  }
}

TEST(Sim3Lie, LeftJacobianAgreesWithDifferences) {
  std::mt19937 random(6);
  constexpr double kStep = 1e-6;
  for (const double size : {0.0, 1e-6, 0.3, 2.0}) {
    const Vector7d x = RandomTangent(random, size, size, size);
    const Sim3d inverse = ExpSim3(x).Inverse();
    const Matrix7d J = LeftJacobianSim3(x);
    for (int i = 0; i < 7; ++i) {
      const Vector7d step = kStep * Vector7d::Unit(i);
      const Vector7d numeric =
          (LogSim3(ExpSim3(x + step) * inverse) - LogSim3(ExpSim3(x - step) * inverse)) / (2.0 * kStep);
      EXPECT_LT((numeric - J.col(i)).norm(), 1e-7 * (1.0 + J.col(i).norm())) << size << " column " << i;
    }
  }
}

TEST(Sim3d, ProductAndInverseActLikeOnPoints) {
  std::mt19937 random(7);
  const Sim3d S_a_b = ExpSim3(RandomTangent(random, 2.0, 3.0, 1.0));
  const Sim3d S_b_c = ExpSim3(RandomTangent(random, 2.0, 3.0, 1.0));
  const Eigen::Vector3d p(0.3, -2.0, 5.0);
  EXPECT_TRUE(((S_a_b * S_b_c) * p).isApprox(S_a_b * (S_b_c * p), 1e-12));
  EXPECT_TRUE((S_a_b.Inverse() * (S_a_b * p)).isApprox(p, 1e-12));
  // Points that the rigid pose sees lie on the same ray.
  EXPECT_TRUE((S_a_b.scale * (S_a_b.RigidPose() * p)).isApprox(S_a_b * p, 1e-12));
}

}  // namespace
}  // namespace sqslam
