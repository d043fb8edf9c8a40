#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>
#include <random>

#include "render/solids/scene_order.h"

namespace sqslam {
namespace {

PosedSuperquadric RandomSolid(std::mt19937& random, const Eigen::Vector3d& center) {
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  PosedSuperquadric solid;
  solid.shape.half_size = {0.3 + uniform(random), 0.3 + uniform(random), 0.3 + uniform(random)};
  solid.shape.e1 = 0.1 + 1.8 * uniform(random);
  solid.shape.e2 = 0.1 + 1.8 * uniform(random);
  const Eigen::Vector3d axis(uniform(random) - 0.5, uniform(random) - 0.5, uniform(random) - 0.5);
  solid.T_map_object.rotation = Eigen::AngleAxisd(6.0 * uniform(random), axis.normalized());
  solid.T_map_object.translation = center;
  return solid;
}

double FarthestOfMany(const PosedSuperquadric& solid, const Eigen::Vector3d& n) {
  double farthest = -1e9;
  for (int i = 0; i <= 200; ++i) {
    for (int k = 0; k <= 400; ++k) {
      const Eigen::Vector3d p =
          solid.shape.PointAt(std::numbers::pi * (i / 200.0 - 0.5), std::numbers::pi * (k / 200.0 - 1.0));
      farthest = std::max(farthest, n.dot(solid.T_map_object * p));
    }
  }
  return farthest;
}

TEST(SeparateTest, FindsPlaneBetweenSeparateSolids) {
  // Two plates at right angles, corner to face: no direction of axes or centres separates them.
  PosedSuperquadric a;
  a.shape = {{1.0, 1.0, 0.1}, 0.2, 0.2};
  PosedSuperquadric b = a;
  b.T_map_object.rotation =
      Eigen::AngleAxisd(0.25 * std::numbers::pi, Eigen::Vector3d(1, 1, 0).normalized()) *
      Eigen::AngleAxisd(0.9, Eigen::Vector3d::UnitX());
  const Eigen::Vector3d n = Eigen::Vector3d(0.5, 0.3, 0.7).normalized();
  b.T_map_object.translation = (SupportExtent(a, n) + SupportExtent(b, n) + 0.02) * n;
  const Separation apart = Separate(a, b);
  EXPECT_GT(apart.gap, 0.0);
  EXPECT_LT(FarthestOfMany(a, apart.direction), apart.middle);
  EXPECT_LT(FarthestOfMany(b, -apart.direction), -apart.middle);
}

TEST(SeparateTest, ReportsOverlapWhenSolidsShareAPoint) {
  std::mt19937 random(8);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  int overlapping = 0;
  for (int i = 0; i < 60; ++i) {
    const PosedSuperquadric a = RandomSolid(random, Eigen::Vector3d::Zero());
    const PosedSuperquadric b = RandomSolid(random, {uniform(random), uniform(random), uniform(random)});
    bool shared = false;
    for (int k = 0; k < 4000 && !shared; ++k) {
      const Eigen::Vector3d p(1.6 * uniform(random), 1.6 * uniform(random), 1.6 * uniform(random));
      shared = a.shape.RadialScale(a.T_map_object.Inverse() * p) < 1.0 &&
               b.shape.RadialScale(b.T_map_object.Inverse() * p) < 1.0;
    }
    overlapping += shared ? 1 : 0;
    EXPECT_TRUE(!shared || Separate(a, b).gap < 0.0) << i;
  }
  EXPECT_GT(overlapping, 10);
}

}  // namespace
}  // namespace sqslam
