#include "slam/objects/gravity.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "synthetic_desk.h"
#include "test_camera.h"

namespace sqslam {
namespace {

using testing::CameraLookingAt;
using testing::SyntheticDesk;

double AngleDeg(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::acos(std::min(1.0, a.dot(b))) * 180.0 / M_PI;
}

struct World {
  std::vector<Eigen::Vector3d> points;
  std::vector<Rigid3d> poses;
  Eigen::Vector3d up;
};

// The synthetic desk and a textured wall behind it, in the frame of the first camera, as a SLAM map begins.
World MakeWorld(int wall_points) {
  const SyntheticDesk desk(2);
  World world;
  const Rigid3d T_map_world = desk.Pose(0).Inverse();
  for (std::int64_t id = 0; desk.Position(id); ++id) {
    world.points.push_back(T_map_world * *desk.Position(id));
  }
  std::mt19937 generator(4);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (int i = 0; i < wall_points; ++i) {
    const double x = uniform(generator);
    const double z = uniform(generator);
    world.points.push_back(T_map_world * Eigen::Vector3d(x, 0.9, 0.5 + 0.5 * z));
  }
  for (int frame = 0; frame < 60; frame += 5) {
    world.poses.push_back(T_map_world * desk.Pose(frame));
  }
  world.up = T_map_world.rotation * Eigen::Vector3d::UnitZ();
  return world;
}

TEST(SupportPlane, FindsTheDeskInsteadOfTheWall) {
  const World world = MakeWorld(1200);
  const auto plane = EstimateSupportPlane(world.points, world.poses, {}, GravityOptions(), 1);
  ASSERT_TRUE(plane);
  EXPECT_LT(AngleDeg(plane->up, world.up), 1.0);
  const Rigid3d T_level = UprightTransform(plane->up);
  EXPECT_LT(AngleDeg(T_level.rotation * plane->up, Eigen::Vector3d::UnitZ()), 1e-4);
  EXPECT_GT(plane->confidence, 0.2);
}

// A narrow desk with things on it, which tilt a plane through its points, on a wide floor.
TEST(SupportPlane, LevelsTheFloorBesideADesk) {
  std::mt19937 generator(7);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::normal_distribution<double> noise(0.0, 0.004);
  World world;
  for (int i = 0; i < 500; ++i) {
    const double x = 0.4 * unit(generator);
    world.points.emplace_back(x, 0.2 * unit(generator), 0.7 + 0.03 * x + noise(generator));
  }
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector2d p(2.0 * unit(generator), 2.0 * unit(generator));
    world.points.emplace_back(p.x(), p.y(), 2.0 * noise(generator));
  }
  for (int i = 0; i < 10; ++i) {
    world.poses.push_back(
        CameraLookingAt({0.0, 0.0, 0.7}, {1.5 * std::cos(0.2 * i), 1.5 * std::sin(0.2 * i), 1.5}));
  }
  const auto plane = EstimateSupportPlane(world.points, world.poses, {}, GravityOptions(), 1);
  ASSERT_TRUE(plane);
  EXPECT_LT(AngleDeg(plane->up, Eigen::Vector3d::UnitZ()), 0.4);
}

TEST(SupportPlane, DependsOnlyOnTheSeed) {
  const World world = MakeWorld(300);
  const auto a = EstimateSupportPlane(world.points, world.poses, {}, GravityOptions(), 5);
  const auto b = EstimateSupportPlane(world.points, world.poses, {}, GravityOptions(), 5);
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->up, b->up);
}

TEST(SupportPlane, RefusesACloudWithoutAPlaneAndTooFewPoints) {
  World world = MakeWorld(0);
  std::mt19937 generator(4);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (Eigen::Vector3d& p : world.points) {
    p = {uniform(generator), uniform(generator), 1.5 + uniform(generator)};
  }
  EXPECT_FALSE(EstimateSupportPlane(world.points, world.poses, {}, GravityOptions(), 1));
  EXPECT_FALSE(EstimateSupportPlane({}, world.poses, {}, GravityOptions(), 1));
  EXPECT_FALSE(EstimateSupportPlane(MakeWorld(0).points, {}, {}, GravityOptions(), 1));
}

TEST(SupportHeight, EqualsTheHeightOfTheDesk) {
  const SyntheticDesk desk(2);
  std::vector<Eigen::Vector3d> points;
  for (std::int64_t id = 0; desk.Position(id); ++id) {
    points.push_back(*desk.Position(id) + Eigen::Vector3d(0, 0, 0.7));
  }
  const auto height = EstimateSupportHeight(points, {}, GravityOptions());
  ASSERT_TRUE(height);
  EXPECT_NEAR(*height, 0.7, 0.004);
}

}  // namespace
}  // namespace sqslam
