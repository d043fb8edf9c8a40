#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "slam/evaluation/object_matching.h"

namespace sqslam {
namespace {

using Eigen::Vector3d;

const Vector3d kUp = Vector3d::UnitZ();

Solid Make(SolidKind kind, const Vector3d& half_size, const Vector3d& center = Vector3d::Zero(),
           double yaw = 0.0) {
  return {kind, half_size, 1.0, 1.0, {Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Vector3d::UnitZ())), center}};
}

TEST(FootprintIoU, IgnoresHeightAndThickness) {
  const Solid magazine = Make(SolidKind::kCuboid, {0.15, 0.1, 0.002});
  const Solid above = Make(SolidKind::kCuboid, {0.15, 0.1, 0.01}, {0, 0, 0.05});
  EXPECT_NEAR(FootprintIoU(magazine, above, kUp), 1.0, 1e-9);
  EXPECT_EQ(IoU(magazine, above), 0.0);
}

TEST(FootprintIoU, EqualsAreaRatioOfRectangles) {
  const Solid a = Make(SolidKind::kCuboid, {1, 2, 1});
  EXPECT_NEAR(FootprintIoU(a, Make(SolidKind::kCuboid, {1, 2, 1}, {1, 0, 0}), kUp), 1.0 / 3.0, 1e-9);
  EXPECT_NEAR(FootprintIoU(a, Make(SolidKind::kCuboid, {2, 1, 1}), kUp), 4.0 / 12.0, 1e-9);
  EXPECT_EQ(FootprintIoU(a, Make(SolidKind::kCuboid, {1, 2, 1}, {3, 0, 0}), kUp), 0.0);
}

TEST(FootprintIoU, EqualsOctagonRatioOfRotatedSquare) {
  const Solid a = Make(SolidKind::kCuboid, {1, 1, 1});
  const Solid b = Make(SolidKind::kCuboid, {1, 1, 1}, {0, 0, 0}, std::numbers::pi / 4);
  const double octagon = 8.0 * (std::sqrt(2.0) - 1.0);
  EXPECT_NEAR(FootprintIoU(a, b, kUp), octagon / (8.0 - octagon), 1e-9);
}

TEST(FootprintIoU, EqualsQuarterPiOfDiscInSquare) {
  const Solid square = Make(SolidKind::kCuboid, {0.5, 0.5, 0.1});
  for (const SolidKind kind : {SolidKind::kCylinder, SolidKind::kEllipsoid, SolidKind::kSuperquadric}) {
    EXPECT_NEAR(FootprintIoU(Make(kind, {0.5, 0.5, 0.3}), square, kUp), std::numbers::pi / 4, 1e-4);
  }
}

// Rounding makes corners of turned boxes differ in their last digits.
TEST(FootprintIoU, DoesNotDependOnWorldRotation) {
  Solid a = Make(SolidKind::kCuboid, {0.15, 0.1, 0.002}, {0.3, -2.0, 1.7}, 0.3);
  Solid b = Solid::FromSuperquadric({{{0.14, 0.11, 0.02}, 0.1, 0.1}, a.T_map_object});
  b.T_map_object.translation += Vector3d(0.02, 0.01, 0.01);
  const double expected = FootprintIoU(a, b, kUp);
  EXPECT_GT(expected, 0.6);
  for (int i = 1; i <= 200; ++i) {
    const Eigen::Quaterniond turn =
        Eigen::AngleAxisd(0.1 * i, Vector3d(1, std::sin(i), std::cos(2 * i)).normalized()) *
        Eigen::Quaterniond::Identity();
    const Sim3d S{2.0, turn, {5, 6, 7}};
    EXPECT_NEAR(FootprintIoU(Transform(S, a), Transform(S, b), turn * kUp), expected, 1e-4) << i;
    EXPECT_NEAR(FootprintIoU(Transform(S, b), Transform(S, a), turn * kUp), expected, 1e-4) << i;
  }
}

TEST(FootprintIoU, ProjectsAlongGivenDirection) {
  const Solid standing = Make(SolidKind::kCuboid, {1, 0.1, 1});
  const Solid lower = Make(SolidKind::kCuboid, {1, 0.1, 1}, {0, 0, 1});
  EXPECT_NEAR(FootprintIoU(standing, lower, Vector3d::UnitY()), 1.0 / 3.0, 1e-9);
}

}  // namespace
}  // namespace sqslam
