#include "slam/objects/handled_solid.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "slam/geometry/superquadric.h"

namespace sqslam {
namespace {

const Eigen::Vector3d kHull(0.6, 0.4, 0.5);

TEST(HandledBody, FillsTheHullExceptTheEndWithTheHandle) {
  const HandledBody body(kHull, true);
  EXPECT_DOUBLE_EQ(body.shift - body.half.x(), -kHull.x());
  EXPECT_LT(body.shift + body.half.x(), kHull.x());
  EXPECT_EQ(body.half.tail<2>(), kHull.tail<2>());
  EXPECT_DOUBLE_EQ(body.half.x(), body.half.y());
  const HandledBody alone(kHull, false);
  EXPECT_EQ(alone.half, kHull);
  EXPECT_EQ(alone.shift, 0.0);
}

TEST(HandledBody, ChainsDerivativesToTheHull) {
  // Any function of the body's half sizes and place.
  const auto value = [](const HandledBody& body) {
    return body.half.x() * body.half.x() + 2.0 * body.half.y() * body.half.z() + 3.0 * body.shift;
  };
  for (const bool handled : {false, true}) {
    const HandledBody body(kHull, handled);
    const Eigen::Vector3d& half = body.half;
    const Eigen::Vector3d by_log_half(2.0 * half.x() * half.x(), 2.0 * half.y() * half.z(),
                                      2.0 * half.y() * half.z());
    const Eigen::Vector3d by_log_hull = body.ByLogHull(by_log_half, 3.0);
    for (int axis = 0; axis < 3; ++axis) {
      constexpr double kStep = 1e-6;
      const auto moved = [&](double step) {
        Eigen::Vector3d hull = kHull;
        hull[axis] *= std::exp(step);
        return value(HandledBody(hull, handled));
      };
      EXPECT_NEAR(by_log_hull[axis], (moved(kStep) - moved(-kStep)) / (2.0 * kStep), 1e-6) << axis << handled;
    }
  }
}

TEST(HandleSupport, EqualsTheFarthestPointOfTheHandle) {
  for (const Eigen::Vector3d n : {Eigen::Vector3d(1.0, 2.0, 0.5), Eigen::Vector3d(-1.0, 0.3, -0.8)}) {
    const double upper = n.dot(Eigen::Vector3d(kHull.x(), 0.0, 0.5 * kHull.z()));
    const double lower = n.dot(Eigen::Vector3d(kHull.x(), 0.0, -0.5 * kHull.z()));
    EXPECT_DOUBLE_EQ(HandleSupport(n, kHull).value, std::max(upper, lower));
  }
}

}  // namespace
}  // namespace sqslam
