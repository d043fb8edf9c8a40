#include "slam/geometry/nearest_solid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "slam/util/enum_names.h"

namespace sqslam {
namespace {

double IoUWith(const PosedSuperquadric& a, const PosedSuperquadric& b) {
  return IoU(Solid::FromSuperquadric(a), Solid::FromSuperquadric(b));
}

// A square upright pillar, fitted with its edges on the axes.
TEST(NearestOfKind, CuboidKeepsSizeWhenExponentExceedsOne) {
  const PosedSuperquadric pillar{{{1.0, 1.0, 2.0}, 0.1, 1.9}, {}};
  PosedSuperquadric of_same_size = pillar;
  of_same_size.shape.e2 = 0.1;
  EXPECT_LT(IoUWith(pillar, of_same_size), 0.6);
  const PosedSuperquadric nearest = NearestOfKind(SolidKind::kCuboid, pillar);
  EXPECT_GT(IoUWith(pillar, nearest), 0.93);
  EXPECT_EQ(nearest.shape.e1, kMinShapeExponent);
  EXPECT_EQ(nearest.shape.e2, kMinShapeExponent);
  EXPECT_NEAR(nearest.shape.half_size.x(), std::numbers::sqrt2 / 2.0, 0.05);
  EXPECT_NEAR(nearest.shape.half_size.z(), 2.0, 0.05);
}

TEST(NearestOfKind, MaximisesIoUForOrientation) {
  const Rigid3d pose{Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ())), {3.0, 2.0, 1.0}};
  for (const auto& [e1, e2] : {std::pair(0.1, 0.1), {1.0, 1.0}, {1.7, 0.6}, {0.4, 1.8}}) {
    const PosedSuperquadric solid{{{0.5, 0.2, 0.3}, e1, e2}, pose};
    for (const SolidKind kind : {SolidKind::kEllipsoid, SolidKind::kCuboid, SolidKind::kCylinder}) {
      const PosedSuperquadric nearest = NearestOfKind(kind, solid);
      const double iou = IoUWith(solid, nearest);
      PosedSuperquadric of_same_size = solid;
      SetExponents(kind, of_same_size.shape.e1, of_same_size.shape.e2);
      EXPECT_GT(iou, IoUWith(solid, of_same_size) - 0.005) << NameOf(kind) << e1 << e2;
      for (const double factor : {0.9, 1.1}) {
        PosedSuperquadric other = nearest;
        other.shape.half_size *= factor;
        EXPECT_GT(iou, IoUWith(solid, other)) << NameOf(kind) << e1 << e2;
      }
      EXPECT_EQ(nearest.T_map_object.translation, pose.translation);
    }
  }
}

TEST(NearestOfKind, KeepsSolidsOfSameKind) {
  const PosedSuperquadric ball{{{0.5, 0.2, 0.3}, 1.0, 1.0}, {}};
  EXPECT_TRUE(
      NearestOfKind(SolidKind::kEllipsoid, ball).shape.half_size.isApprox(ball.shape.half_size, 0.01));
  const PosedSuperquadric any{{{0.5, 0.2, 0.3}, 0.7, 1.3}, {}};
  EXPECT_EQ(NearestOfKind(SolidKind::kSuperquadric, any).shape.half_size, any.shape.half_size);
  EXPECT_EQ(NearestOfKind(SolidKind::kSuperquadric, any).shape.e2, 1.3);
}

}  // namespace
}  // namespace sqslam
