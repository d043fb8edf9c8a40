#include "slam/objects/support.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

namespace sqslam {
namespace {

using ::testing::DoubleNear;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

// A desk (z = 0.7, x and y within 1 of the origin) on a floor (z = 0, within 3), and a wall at y = 3.
std::vector<Eigen::Vector3d> Room(int seed = 1) {
  std::mt19937 generator(static_cast<unsigned>(seed));
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::normal_distribution<double> noise(0.0, 0.003);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 400; ++i) {
    points.emplace_back(unit(generator), unit(generator), 0.7 + noise(generator));
  }
  while (points.size() < 700) {
    const Eigen::Vector3d p(3.0 * unit(generator), 3.0 * unit(generator), noise(generator));
    if (p.head<2>().cwiseAbs().maxCoeff() > 1.2) {  // the desk hides what is below it
      points.push_back(p);
    }
  }
  for (int i = 0; i < 300; ++i) {
    points.emplace_back(3.0 * unit(generator), 3.0, 1.0 + unit(generator));
  }
  return points;
}

TEST(SupportSurfaces, FindsDeskAndFloorInsteadOfTheWall) {
  const SupportSurfaces surfaces = SupportSurfaces::Find(Room(), GravityOptions());
  ASSERT_EQ(surfaces.All().size(), 2u);
  EXPECT_NEAR(surfaces.All()[0].height, 0.7, 0.01);
  EXPECT_NEAR(surfaces.All()[1].height, 0.0, 0.01);
}

TEST(SupportSurfaces, TakesLowestForFloorUnlessPointsLieBelow) {
  std::vector<Eigen::Vector3d> points = Room();
  const SupportSurfaces room = SupportSurfaces::Find(points, GravityOptions());
  ASSERT_TRUE(room.Floor());
  EXPECT_NEAR(*room.Floor(), 0.0, 0.01);
  SupportSurfaces moved = room;
  moved.Transform({2.0, Eigen::Quaterniond::Identity(), {0.0, 0.0, 1.0}});
  EXPECT_NEAR(*moved.Floor(), 1.0, 0.02);
  for (int i = 0; i < 100; ++i) {
    points.emplace_back(0.02 * i, 0.0, -0.1);  // badly measured
  }
  for (int i = 0; i < 10; ++i) {
    points.emplace_back(0.1 * i, 0.0, -0.5 - 0.05 * i);  // mirrored
  }
  ASSERT_TRUE(SupportSurfaces::Find(points, GravityOptions()).Floor());
  points = Room();
  std::erase_if(points, [](const Eigen::Vector3d& p) { return p.z() < 0.05; });
  const SupportSurfaces hidden = SupportSurfaces::Find(points, GravityOptions());
  ASSERT_EQ(hidden.All().size(), 1u);
  EXPECT_EQ(hidden.Floor(), std::nullopt) << "the wall reaches below the desk";
}

TEST(SupportSurfaces, FindsSurfacesUnderObjects) {
  const SupportSurfaces surfaces = SupportSurfaces::Find(Room(), GravityOptions());
  EXPECT_THAT(surfaces.Under({0.3, 0.2}, 0.3, 0.8),
              ElementsAre(DoubleNear(0.7, 0.01), DoubleNear(0.0, 0.01)));
  EXPECT_THAT(surfaces.Under({2.0, 2.0}, 0.3, 0.8), ElementsAre(DoubleNear(0.0, 0.01)));
  EXPECT_THAT(surfaces.Under({0.3, 0.2}, 0.3, 0.5), ElementsAre(DoubleNear(0.0, 0.01)));  // the desk is above
  EXPECT_THAT(surfaces.Under({2.0, 9.0}, 0.3, 0.8), IsEmpty());                           // behind the wall
}

TEST(SupportSurfaces, IgnoresTopsOfNeighbours) {
  std::vector<Eigen::Vector3d> points = Room();
  PosedSuperquadric keyboard;  // on the desk
  keyboard.shape = {{0.4, 0.2, 0.04}, 0.1, 0.1};
  keyboard.T_map_object.translation = {0.0, 0.0, 0.74};
  for (int i = 0; i < 200; ++i) {
    points.emplace_back(-0.38 + 0.04 * (i % 20), -0.18 + 0.04 * (i / 20), 0.78);
  }
  const SupportSurfaces surfaces = SupportSurfaces::Find(points, GravityOptions());
  ASSERT_EQ(surfaces.All().size(), 3u);
  EXPECT_EQ(surfaces.Around({0.8, 0.0}, {&keyboard, 1}).All().size(), 2u);  // a cup beside it
  EXPECT_EQ(surfaces.Around({0.1, 0.1}, {&keyboard, 1}).All().size(), 3u);  // a pen on it
  EXPECT_EQ(surfaces.Around({0.8, 0.0}, {}).All().size(), 3u);
}

// A flat thing with many points on a mapped desk: the layer with the most points lies on the thing.
TEST(SupportSurfaces, FindsHeightOfADeskUnderFlatThings) {
  std::mt19937 generator(5);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::normal_distribution<double> noise(0.0, 0.001);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 200; ++i) {
    points.emplace_back(0.8 * unit(generator), 0.5 + 0.3 * unit(generator), 0.7 + noise(generator));
  }
  for (int i = 0; i < 300; ++i) {
    points.emplace_back(0.4 * unit(generator), 0.1 * unit(generator), 0.706 + noise(generator));
  }
  std::vector<PosedSuperquadric> others(2);
  others[0].shape = {{0.42, 0.12, 0.003}, 0.1, 0.1};
  others[0].T_map_object.translation = {0.0, 0.0, 0.703};
  others[1].shape = {{0.9, 0.9, 0.35}, 0.1, 0.1};
  others[1].T_map_object.translation = {0.0, 0.0, 0.35};
  const SupportSurfaces surfaces = SupportSurfaces::Find(points, GravityOptions());
  ASSERT_EQ(surfaces.All().size(), 1U);
  EXPECT_GT(surfaces.All().front().height, 0.703);
  EXPECT_THAT(surfaces.Around({0.6, 0.4}, others).Under({0.6, 0.4}, 0.4, 0.8),
              ElementsAre(DoubleNear(0.7, 0.001)));
}

TEST(SupportSurfaces, KeepsTableTopUnderItsObjectsWhenCovered) {
  const SupportSurfaces surfaces = SupportSurfaces::Find(Room(), GravityOptions());
  PosedSuperquadric table;  // mapped a little too short
  table.shape = {{0.85, 0.95, 0.36}, 0.1, 0.1};
  table.T_map_object.translation = {-0.1, 0.0, 0.35};
  PosedSuperquadric wrong;  // a second landmark within it, over most of its points
  wrong.shape = {{0.7, 0.9, 0.33}, 0.1, 0.1};
  wrong.T_map_object.translation = {-0.4, 0.0, 0.4};
  const std::vector<PosedSuperquadric> others = {table, wrong};
  const Eigen::Vector2d place(0.65, 0.3);
  EXPECT_THAT(surfaces.Around(place, others).Under(place, 0.4, 0.8),
              ElementsAre(DoubleNear(0.7, 0.01), DoubleNear(0.0, 0.01)));
  EXPECT_EQ(surfaces.Around({0.65, 0.3}, {&wrong, 1}).All().size(), 1u);  // nothing says that it is a table
}

TEST(SupportSurfaces, MoveWithTheMap) {
  SupportSurfaces surfaces = SupportSurfaces::Find(Room(), GravityOptions());
  const Sim3d move{
      2.0, Eigen::Quaterniond(Eigen::AngleAxisd(1.0, Eigen::Vector3d::UnitZ())), {3.0, 4.0, 5.0}};
  surfaces.Transform(move);
  const Eigen::Vector3d place = move * Eigen::Vector3d(2.0, 2.0, 0.0);
  EXPECT_THAT(surfaces.Under(place.head<2>(), 0.6, 7.0), ElementsAre(DoubleNear(5.0, 0.02)));
}

// The floor around a desk is farther away than the desk, so its points scatter more.
TEST(SupportSurfaces, FindsFloorWhosePointsScatter) {
  std::mt19937 generator(3);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::normal_distribution<double> noise(0.0, 1.0);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 800; ++i) {
    points.emplace_back(0.4 * unit(generator), 0.4 * unit(generator), 0.7 + 0.002 * noise(generator));
  }
  for (int i = 0; i < 80; ++i) {
    points.emplace_back(2.0 * unit(generator), 2.0 * unit(generator), 0.012 * noise(generator));
  }
  const SupportSurfaces surfaces = SupportSurfaces::Find(points, GravityOptions());
  ASSERT_TRUE(surfaces.Floor());
  EXPECT_NEAR(*surfaces.Floor(), 0.0, 0.01);
}

TEST(SupportSurfaces, NeedPoints) {
  EXPECT_THAT(SupportSurfaces::Find({}, GravityOptions()).All(), IsEmpty());
}

}  // namespace
}  // namespace sqslam
