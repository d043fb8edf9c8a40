#include "slam/geometry/solid_iou.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

namespace sqslam {
namespace {

using Eigen::Vector3d;
constexpr double kPi = std::numbers::pi;

Rigid3d Pose(const Vector3d& translation, double yaw = 0.0, const Vector3d& axis = Vector3d::UnitZ()) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(yaw, axis.normalized())), translation};
}

Solid Cuboid(const Vector3d& half_size, const Rigid3d& pose = {}) {
  return {SolidKind::kCuboid, half_size, 1, 1, pose};
}
Solid Ellipsoid(const Vector3d& half_size, const Rigid3d& pose = {}) {
  return {SolidKind::kEllipsoid, half_size, 1, 1, pose};
}
Solid Cylinder(const Vector3d& half_size, const Rigid3d& pose = {}) {
  return {SolidKind::kCylinder, half_size, 1, 1, pose};
}
Solid Shaped(const Vector3d& half_size, double e1, double e2, const Rigid3d& pose = {}) {
  return Solid::FromSuperquadric({{half_size, e1, e2}, pose});
}

// Relative agreement to the promised 0.5 %.
void ExpectIoU(double expected, const Solid& a, const Solid& b) {
  EXPECT_NEAR(IoU(a, b) / expected, 1.0, 0.005) << "expected " << expected << ", is " << IoU(a, b);
}

TEST(SolidIoU, ShiftedBoxesOverlapByProductOfSides) {
  for (const double shift : {0.0, 0.011, 0.1, 0.37, 0.5, 0.73, 0.9}) {
    const double intersection = (1 - shift) * 8;
    ExpectIoU(intersection / (16 - intersection), Cuboid({1, 1, 1}),
              Cuboid({1, 1, 1}, Pose({2 * shift, 0, 0})));
  }
  const double corner = 0.3 * 0.4 * 0.5;
  ExpectIoU(corner / (2 - corner), Cuboid({0.5, 0.5, 0.5}), Cuboid({0.5, 0.5, 0.5}, Pose({0.7, 0.6, -0.5})));
}

TEST(SolidIoU, RotatedFrameKeepsIoU) {
  const Rigid3d turned = Pose({0.3, -1, 2}, 0.7, {1, 2, 3});
  for (const double shift : {0.05, 0.31, 0.62}) {
    const Rigid3d moved = turned * Pose({2 * shift, 0, 0});
    ExpectIoU((1 - shift) / (1 + shift), Cuboid({1, 0.2, 0.05}, turned), Cuboid({1, 0.2, 0.05}, moved));
  }
}

TEST(SolidIoU, ConcentricSolidsCompareByVolume) {
  ExpectIoU(std::pow(0.8, 3), Ellipsoid({1, 1, 1}), Ellipsoid({0.8, 0.8, 0.8}));
  ExpectIoU(kPi / 6, Cuboid({1, 2, 3}), Ellipsoid({1, 2, 3}));
  ExpectIoU(kPi / 4, Cuboid({1, 2, 3}), Cylinder({1, 2, 3}));
  ExpectIoU(2.0 / 3.0, Cylinder({1, 2, 3}), Ellipsoid({1, 2, 3}));
  ExpectIoU(1.0, Shaped({1, 2, 3}, 1, 1), Ellipsoid({1, 2, 3}));
  for (const double e1 : {0.1, 0.7, 1.9}) {
    for (const double e2 : {0.1, 0.7, 1.9}) {
      const Solid shape = Shaped({0.3, 0.2, 0.5}, e1, e2);
      ExpectIoU(shape.Volume() / (8 * 0.3 * 0.2 * 0.5), shape, Cuboid({0.3, 0.2, 0.5}));
    }
  }
}

TEST(SolidIoU, SpheresShareLens) {
  for (const double d : {0.2, 1.0, 1.7}) {
    const double lens = kPi * (4 + d) * (2 - d) * (2 - d) / 12;
    ExpectIoU(lens / (8 * kPi / 3 - lens), Ellipsoid({1, 1, 1}), Ellipsoid({1, 1, 1}, Pose({0, d, 0})));
  }
}

TEST(SolidIoU, RotatedCubeSharesOctagonalPrism) {
  const double octagon = 8 * (std::sqrt(2.0) - 1);  // of the square of side 2
  ExpectIoU(octagon / (8 - octagon), Cuboid({1, 1, 1}), Cuboid({1, 1, 1}, Pose({0, 0, 0}, kPi / 4)));
  ExpectIoU(octagon / (8 - octagon), Cuboid({1, 1, 0.01}), Cuboid({1, 1, 0.01}, Pose({0, 0, 0}, kPi / 4)));
}

TEST(SolidIoU, CrossedPlatesShareCore) {
  const double core = 0.1 * 0.1 * 2;
  ExpectIoU(core / (2 * 0.4 - core), Cuboid({1, 0.05, 1}), Cuboid({0.05, 1, 1}));
}

TEST(SolidIoU, ReturnsZeroForSeparateOrDegenerateSolids) {
  EXPECT_EQ(IoU(Cuboid({1, 1, 1}), Cuboid({1, 1, 1}, Pose({2.1, 0, 0}))), 0.0);
  EXPECT_EQ(IoU(Ellipsoid({1, 1, 1}), Ellipsoid({1, 1, 1}, Pose({1.5, 1.5, 0}))), 0.0);
  EXPECT_EQ(IoU(Cuboid({1, 1, 0}), Cuboid({1, 1, 1})), 0.0);
  EXPECT_EQ(IoU(Cuboid({1, 1, std::nan("")}), Cuboid({1, 1, 1})), 0.0);
}

struct RandomPair {
  Solid a, b;
};

std::vector<RandomPair> RandomPairs(int count) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto vector = [&] { return Vector3d(unit(random), unit(random), unit(random)); };
  const auto solid = [&](SolidKind kind) {
    return Solid{kind, 0.6 * Vector3d::Ones() + 0.4 * vector(), 1.0 + 0.9 * unit(random),
                 1.0 + 0.9 * unit(random), Pose(0.2 * vector(), 3 * unit(random), vector())};
  };
  constexpr SolidKind kKinds[] = {SolidKind::kSuperquadric, SolidKind::kCuboid, SolidKind::kCylinder,
                                  SolidKind::kEllipsoid};
  std::vector<RandomPair> pairs;
  for (int i = 0; i < count; ++i) {
    pairs.push_back({solid(SolidKind::kSuperquadric), solid(kKinds[i % 4])});
  }
  return pairs;
}

TEST(SolidIoU, DoesNotDependOnOrderFrameOrUnit) {
  const Sim3d S{
      37.0, Eigen::Quaterniond(Eigen::AngleAxisd(1.1, Vector3d(1, -2, 0.5).normalized())), {100, -20, 3}};
  for (const auto& [a, b] : RandomPairs(12)) {
    const double iou = IoU(a, b);
    EXPECT_GT(iou, 0.0);
    EXPECT_NEAR(IoU(b, a), iou, 0.005 * iou);
    EXPECT_NEAR(IoU(Transform(S, a), Transform(S, b)), iou, 0.005 * iou);
    EXPECT_EQ(IoU(a, b), iou);  // deterministic
  }
}

// Oracle: plain Monte Carlo over the box of one solid with Contains().
TEST(SolidIoU, AgreesWithMonteCarlo) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> unit(0, 1);
  constexpr int kSamples = 200000;
  for (const auto& [a, b] : RandomPairs(8)) {
    const Eigen::AlignedBox3d box = a.BoundingBox();
    int both = 0;
    int only_a = 0;
    for (int i = 0; i < kSamples; ++i) {
      const Vector3d p =
          box.min() + Vector3d(unit(random), unit(random), unit(random)).cwiseProduct(box.sizes());
      if (a.Contains(p)) {
        ++only_a;
        both += b.Contains(p) ? 1 : 0;
      }
    }
    const double share = static_cast<double>(both) / kSamples;
    const double sigma = std::sqrt(share * (1 - share) / kSamples) * box.volume();
    const double intersection = share * box.volume();
    const double whole = a.Volume() + b.Volume();
    const double iou = IoU(a, b);
    EXPECT_NEAR(iou * whole / (1 + iou), intersection, 4.5 * sigma + 0.005 * intersection);
    EXPECT_NEAR(only_a * box.volume() / kSamples / a.Volume(), 1.0, 0.03);
  }
}

TEST(SolidIoU, ConvergesForAllShapes) {
  // Thin, tilted and barely touching: the octree's hardest cases.
  const Solid sheet = Cuboid({0.15, 0.1, 0.002}, Pose({0, 0, 0}, 0.3));
  const Solid tilted = Shaped({0.15, 0.1, 0.002}, 0.1, 0.1, Pose({0.01, 0, 0.001}, 0.3, {0.02, 0.01, 1}));
  const double iou = IoU(sheet, tilted);
  EXPECT_GT(iou, 0.1);
  EXPECT_LT(iou, 0.7);
  EXPECT_NEAR(IoU(tilted, sheet), iou, 0.005 * iou);
}

TEST(NearestPrimitive, FindsEachByItsUsualExponents) {
  for (const SolidKind primitive : kPrimitives) {
    const auto [e1, e2] = UsualExponents(primitive);
    EXPECT_EQ(NearestPrimitive(e1, e2), primitive);
  }
}

}  // namespace
}  // namespace sqslam
