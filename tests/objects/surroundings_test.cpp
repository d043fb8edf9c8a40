#include "slam/objects/surroundings.h"

#include <gtest/gtest.h>

namespace sqslam {
namespace {

Landmark MappedBox(int id, const Eigen::Vector3d& centre, const Eigen::Vector3d& half_size) {
  Landmark landmark;
  landmark.id = id;
  landmark.estimated = true;
  landmark.superquadric.shape = {half_size, 0.1, 0.1};
  landmark.superquadric.T_map_object.translation = centre;
  landmark.visible = landmark.superquadric;
  return landmark;
}

TEST(Surroundings, ListsContentsAndOccluders) {
  Landmark table = MappedBox(1, {0.0, 2.0, 0.35}, {0.8, 0.5, 0.35});
  table.support = 0.0;
  const Landmark cup = MappedBox(2, {0.0, 2.0, 0.75}, {0.04, 0.04, 0.05});
  const Landmark chair = MappedBox(3, {0.1, 2.8, 0.75}, {0.2, 0.05, 0.15});
  const std::vector<const Landmark*> shown = {&table, &cup, &chair};

  const Surroundings of_table = SurroundingsOf(table, shown, ClassTable());
  EXPECT_EQ(of_table.smaller.size(), 2u);
  EXPECT_TRUE(of_table.occluders.empty());
  EXPECT_EQ(of_table.hidden_support, std::nullopt);

  const Surroundings of_cup = SurroundingsOf(cup, shown, ClassTable());
  EXPECT_TRUE(of_cup.smaller.empty());
  EXPECT_EQ(of_cup.hidden_support, std::nullopt);  // on the table, not behind it

  const Surroundings of_chair = SurroundingsOf(chair, shown, ClassTable());
  ASSERT_EQ(of_chair.occluders.size(), 1u);
  EXPECT_EQ(of_chair.occluders[0].shape.half_size, table.superquadric.shape.half_size);
  EXPECT_EQ(of_chair.smaller.size(), 1u);
  EXPECT_EQ(of_chair.hidden_support, 0.0);
}

TEST(Surroundings, FindsTopByObjectsOnIt) {
  const Landmark table = MappedBox(1, {0.0, 2.0, 0.36}, {0.8, 0.5, 0.36});
  Landmark cup = MappedBox(2, {0.3, 2.1, 0.75}, {0.04, 0.04, 0.05});
  cup.support = 0.7;
  Landmark bin = MappedBox(3, {0.0, 2.0, 0.2}, {0.1, 0.1, 0.2});  // under the table
  bin.support = 0.0;
  Landmark beside = MappedBox(4, {2.0, 2.0, 0.8}, {0.1, 0.1, 0.1});
  beside.support = 0.69;
  const std::vector<const Landmark*> shown = {&table, &cup, &bin, &beside};
  EXPECT_EQ(SurroundingsOf(table, shown, ClassTable()).top_height, 0.7);
  EXPECT_EQ(SurroundingsOf(cup, shown, ClassTable()).top_height, std::nullopt);
}

TEST(Surroundings, PutsCupsOnTheTableNotTheChairUnderIt) {
  const Landmark chair = MappedBox(1, {0.0, 2.4, 0.4}, {0.25, 0.25, 0.4});
  Landmark cup = MappedBox(2, {0.0, 2.3, 0.76}, {0.04, 0.04, 0.05});
  cup.support = 0.71;
  std::vector<const Landmark*> shown = {&chair, &cup};
  EXPECT_EQ(SurroundingsOf(chair, shown, ClassTable()).top_height, 0.71);
  const Landmark top = MappedBox(3, {0.0, 2.0, 0.7}, {0.8, 0.5, 0.01});  // all that is known of a table
  shown.push_back(&top);
  EXPECT_EQ(SurroundingsOf(chair, shown, ClassTable()).top_height, std::nullopt);
}

TEST(DirectionToTableAxis, PointsAcrossTheTableFromItsSideAndAlongItFromItsEnd) {
  PosedSuperquadric table = MappedBox(1, {1.0, 2.0, 0.35}, {0.8, 0.5, 0.35}).superquadric;
  EXPECT_TRUE(DirectionToTableAxis(table, {1.2, 2.7, 0.4}).isApprox(Eigen::Vector3d(0.0, -0.7, 0.0)));
  EXPECT_TRUE(DirectionToTableAxis(table, {1.2, 2.4, 0.4}).isApprox(Eigen::Vector3d(0.0, -0.4, 0.0)))
      << "under it";
  EXPECT_TRUE(DirectionToTableAxis(table, {2.1, 2.0, 0.4}).isApprox(Eigen::Vector3d(-0.8, 0.0, 0.0)));
  const Rigid3d turn(Eigen::Quaterniond(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ())), {0.3, -0.2, 0.1});
  table.T_map_object = turn * table.T_map_object;
  EXPECT_TRUE(DirectionToTableAxis(table, turn * Eigen::Vector3d(1.2, 2.7, 0.4))
                  .isApprox(turn.rotation * Eigen::Vector3d(0.0, -0.7, 0.0)));
}

TEST(Surroundings, LetsTableHideChairWithBackAboveIt) {
  const Landmark table = MappedBox(1, {0.0, 2.0, 0.35}, {0.8, 0.5, 0.35});
  Landmark back = MappedBox(2, {0.1, 2.4, 0.85}, {0.2, 0.05, 0.12});
  back.labels.Add("chair", 0.9);
  const std::vector<const Landmark*> shown = {&table, &back};
  EXPECT_TRUE(SurroundingsOf(back, shown, ClassTable()).occluders.empty());
  EXPECT_EQ(SurroundingsOf(back, shown, ClassTable::Named("default")).occluders.size(), 1u);
}

TEST(Surroundings, IgnoresDistantOccludersAndKnowsNothingWithoutEstimate) {
  Landmark table = MappedBox(1, {0.0, 2.0, 0.35}, {0.8, 0.5, 0.35});
  table.support = 0.0;
  const std::vector<const Landmark*> shown = {&table};
  Landmark chair = MappedBox(3, {0.1, 6.0, 0.75}, {0.2, 0.05, 0.15});
  EXPECT_EQ(SurroundingsOf(chair, shown, ClassTable()).occluders.size(), 1u);
  EXPECT_EQ(SurroundingsOf(chair, shown, ClassTable()).hidden_support, std::nullopt);
  chair.estimated = false;
  EXPECT_TRUE(SurroundingsOf(chair, shown, ClassTable()).occluders.empty());
}

TEST(Surroundings, LetsObjectsOfUnknownSizeHideNothing) {
  Landmark table = MappedBox(1, {0.0, 2.0, 0.35}, {0.8, 0.5, 0.35});
  const Landmark chair = MappedBox(3, {0.1, 2.8, 0.75}, {0.2, 0.05, 0.15});
  const std::vector<const Landmark*> shown = {&table};
  table.refined = true;
  table.covariance(3, 3) = 0.01;  // 0.1 of 0.8
  EXPECT_EQ(SurroundingsOf(chair, shown, ClassTable()).occluders.size(), 1u);
  table.covariance(3, 3) = 0.25;
  EXPECT_TRUE(SurroundingsOf(chair, shown, ClassTable()).occluders.empty());
}

}  // namespace
}  // namespace sqslam
