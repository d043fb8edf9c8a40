#include "slam/geometry/eigen_system.h"

#include <gtest/gtest.h>

#include "slam/geometry/rigid3.h"

namespace sqslam {
namespace {

TEST(EigenSystem, RebuildsMatrixWithAscendingValues) {
  Eigen::Matrix4d m;
  m << 4.0, 1.0, -2.0, 0.5, 1.0, 3.0, 0.0, 0.2, -2.0, 0.0, 5.0, 1.0, 0.5, 0.2, 1.0, -1.0;
  const EigenSystem<4> system = EigenSystemOf(m);
  EXPECT_TRUE((system.vectors * system.values.asDiagonal() * system.vectors.transpose()).isApprox(m, 1e-12));
  EXPECT_LT(system.values[0], 0.0);
  for (int i = 1; i < 4; ++i) {
    EXPECT_LT(system.values[i - 1], system.values[i]);
  }
  EXPECT_EQ(EigenSystemOf(Eigen::Matrix2d(Eigen::Vector2d(3.0, 2.0).asDiagonal())).values,
            Eigen::Vector2d(2.0, 3.0));
}

TEST(RotationBetween, GivesSmallestRotationEvenWhenOpposite) {
  const Eigen::Vector3d a(0.3, -2.0, 1.0), b(4.0, 0.1, 0.7);
  const Eigen::Quaterniond turn = RotationBetween(a, b);
  EXPECT_TRUE((turn * a.normalized()).isApprox(b.normalized(), 1e-12));
  EXPECT_NEAR(Eigen::AngleAxisd(turn).angle(), std::acos(a.normalized().dot(b.normalized())), 1e-9);
  EXPECT_TRUE((RotationBetween(a, -2.0 * a) * a).isApprox(-a, 1e-9));
  EXPECT_TRUE(RotationBetween(a, 3.0 * a).isApprox(Eigen::Quaterniond::Identity(), 1e-12));
}

}  // namespace
}  // namespace sqslam
