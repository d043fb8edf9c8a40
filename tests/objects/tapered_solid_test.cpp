#include "slam/objects/tapered_solid.h"

#include <gtest/gtest.h>

#include <cmath>

#include "slam/geometry/superquadric.h"
#include "slam/geometry/superquadric_norm.h"

namespace sqslam {
namespace {

constexpr double kE1 = 0.1;
constexpr double kE2 = 1.0;

TEST(TaperedSupport, EqualsTheSuperquadricWithoutTaper) {
  const Superquadric shape{{0.3, 0.2, 0.4}, 0.7, 0.4};
  for (const Eigen::Vector3d n :
       {Eigen::Vector3d(1, 2, 3), Eigen::Vector3d(-2, 1, -0.1), Eigen::Vector3d(0, 1, 0)}) {
    const TaperedSupport support(n.cwiseProduct(shape.half_size), 1.0, DualPower(shape.e1),
                                 DualPower(shape.e2));
    EXPECT_NEAR(support.value, shape.SupportExtent(n), 1e-9);
  }
}

TEST(TaperedSupport, EqualsTheFarthestPointOfTheSolid) {
  const Superquadric shape{{0.3, 0.3, 0.4}, kE1, kE2};
  const auto farthest = [&](const Eigen::Vector3d& n, double taper) {
    double reach = 0.0;
    for (int i = 0; i <= 40; ++i) {
      for (int k = 0; k < 60; ++k) {
        Eigen::Vector3d p = shape.PointAt(-M_PI / 2 + M_PI * i / 40, 2.0 * M_PI * k / 60);
        p.head<2>() *= TaperedWidth(p.z(), shape.half_size.z(), p.z() * n.z() > 0.0 ? taper : 1.0).value;
        reach = std::max(reach, n.dot(p));
      }
    }
    return reach;
  };
  for (const double taper : {0.3, 0.6, 1.0}) {
    for (const double up : {-3.0, -1.0, -0.2, 0.0, 0.5, 2.0}) {
      const Eigen::Vector3d n = Eigen::Vector3d(0.8, 0.6, up).normalized();
      const TaperedSupport support(n.cwiseProduct(shape.half_size), taper, DualPower(kE1), DualPower(kE2));
      EXPECT_NEAR(support.value, farthest(n, taper), 0.03 * support.value) << taper << " " << up;
    }
  }
}

TEST(TaperedWidth, FallsToTheTaperAtTheEndAndStaysBeyond) {
  EXPECT_DOUBLE_EQ(TaperedWidth(0.0, 0.4, 0.5).value, 1.0);
  EXPECT_DOUBLE_EQ(TaperedWidth(-0.2, 0.4, 0.5).value, 0.75);
  EXPECT_DOUBLE_EQ(TaperedWidth(0.4, 0.4, 0.5).value, 0.5);
  EXPECT_DOUBLE_EQ(TaperedWidth(-0.6, 0.4, 0.5).value, 0.5);
}

}  // namespace
}  // namespace sqslam
