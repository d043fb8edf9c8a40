#include "render/solids/ground_shadow.h"

#include <gtest/gtest.h>

#include <cmath>

namespace sqslam {
namespace {

// Darkness at a place of the plane z = 0, in [0, 1].
double DarknessAt(const GroundShadow& shadow, double x, double y) {
  const Eigen::Vector3d offset = Eigen::Vector3d(x, y, 0.0) - shadow.corner;
  const double u = offset.dot(shadow.across) / shadow.across.squaredNorm() * shadow.darkness.cols;
  const double v = offset.dot(shadow.down) / shadow.down.squaredNorm() * shadow.darkness.rows;
  const cv::Point at(static_cast<int>(std::floor(u)), static_cast<int>(std::floor(v)));
  return cv::Rect({}, shadow.darkness.size()).contains(at) ? shadow.darkness.at<std::uint8_t>(at) / 255.0
                                                           : 0.0;
}

PosedSuperquadric Box(double height) {
  PosedSuperquadric box;
  box.shape = {{0.5, 0.5, 0.1}, 0.1, 0.1};
  box.T_map_object.translation.z() = height;
  return box;
}

const ShadowLight kStraightDown = {.towards = Eigen::Vector3d::UnitZ(), .size = 0.1, .lamp = 1.0};

TEST(GroundShadowTest, DarkensOnlyGroundUnderSolid) {
  const PosedSuperquadric box = Box(0.1);
  const GroundShadow shadow = CastGroundShadow({&box, 1}, Eigen::Vector3d::UnitZ(), 0.0, kStraightDown);
  EXPECT_GT(DarknessAt(shadow, 0.0, 0.0), 0.97);
  EXPECT_GT(DarknessAt(shadow, 0.45, 0.45), 0.9);
  EXPECT_LT(DarknessAt(shadow, 0.6, 0.0), 0.03);
}

TEST(GroundShadowTest, SoftensWhenSolidIsHigher) {
  const PosedSuperquadric low = Box(0.1);
  const PosedSuperquadric high = Box(3.0);
  const auto at_rim = [&](const PosedSuperquadric& box, double x) {
    return DarknessAt(CastGroundShadow({&box, 1}, Eigen::Vector3d::UnitZ(), 0.0, kStraightDown), x, 0.0);
  };
  EXPECT_GT(at_rim(low, 0.42), at_rim(high, 0.42) + 0.1);
  EXPECT_LT(at_rim(low, 0.6), at_rim(high, 0.6) - 0.05);
}

TEST(GroundShadowTest, FallsAwayFromLamp) {
  ShadowLight slanted = kStraightDown;
  slanted.towards = Eigen::Vector3d(1.0, 0.0, 1.0).normalized();
  const PosedSuperquadric box = Box(1.0);
  const GroundShadow shadow = CastGroundShadow({&box, 1}, Eigen::Vector3d::UnitZ(), 0.0, slanted);
  EXPECT_GT(DarknessAt(shadow, -1.0, 0.0), 0.9);
  EXPECT_LT(DarknessAt(shadow, 1.0, 0.0), 0.03);
}

TEST(GroundShadowTest, IgnoresSolidsBelowGround) {
  const PosedSuperquadric box = Box(-1.0);
  EXPECT_TRUE(CastGroundShadow({&box, 1}, Eigen::Vector3d::UnitZ(), 0.0, kStraightDown).darkness.empty());
}

}  // namespace
}  // namespace sqslam
