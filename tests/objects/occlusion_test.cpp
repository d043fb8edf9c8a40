#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "slam/objects/landmark_geometry.h"
#include "slam/objects/surroundings.h"
#include "test_camera.h"

namespace sqslam {
namespace {

using ::testing::ElementsAre;
using testing::TestCamera;

constexpr double kTableTop = 0.7;

PosedSuperquadric Box(const Eigen::Vector3d& centre, const Eigen::Vector3d& half_size) {
  PosedSuperquadric box;
  box.shape = {half_size, 0.1, 0.1};
  box.T_map_object.translation = centre;
  return box;
}

PosedSuperquadric Table() { return Box({0.0, 2.0, 0.35}, {0.8, 0.5, 0.35}); }

// At 1.3 above the floor, looking along y and 20 degrees down.
Rigid3d Pose() {
  const Eigen::Vector3d forward(0.0, std::cos(0.35), -std::sin(0.35));
  Eigen::Matrix3d R;
  R.col(0) = Eigen::Vector3d::UnitX();
  R.col(2) = forward;
  R.col(1) = forward.cross(Eigen::Vector3d::UnitX());
  return {Eigen::Quaterniond(R), {0.0, 0.0, 1.3}};
}

std::array<bool, 4> HiddenByTheTable(const PosedSuperquadric& seen) {
  const Box2d box = *ProjectToBox(seen, Pose(), TestCamera());
  const double depth = (Pose().Inverse() * seen.T_map_object.translation).z();
  return EdgesHiddenBy(box, depth, Pose(), TestCamera(), Table());
}

TEST(EdgesHiddenBy, ATableHidesTheLegsOfTheChairBehindIt) {
  EXPECT_THAT(HiddenByTheTable(Box({0.1, 2.8, 0.75}, {0.2, 0.05, 0.15})),
              ElementsAre(false, false, false, true));
}

TEST(EdgesHiddenBy, NothingIsHiddenBesideOrBeforeIt) {
  EXPECT_THAT(HiddenByTheTable(Box({1.6, 2.8, 0.75}, {0.2, 0.05, 0.15})),
              ElementsAre(false, false, false, false));
  EXPECT_THAT(HiddenByTheTable(Box({0.0, 1.2, 0.5}, {0.1, 0.05, 0.15})),
              ElementsAre(false, false, false, false));
}

TEST(EdgesHiddenBy, ATableTakenTooHighHidesNothingAtItsRim) {
  // A cup that stands 2 cm deep in the table, a hand's breadth before the far rim.
  const PosedSuperquadric cup = Box({0.1, 2.42, kTableTop + 0.03}, {0.04, 0.04, 0.05});
  EXPECT_THAT(HiddenByTheTable(cup), ElementsAre(false, false, false, false));
}

TEST(MayHide, IsNotTheTableForWhatSinksIntoItsTop) {
  EXPECT_FALSE(MayHide(Table(), Box({0.1, 2.2, kTableTop - 0.05}, {0.04, 0.04, 0.05}), {}));
}

// Its points are those above the seat, whatever the last fit.
TEST(MayHide, IsNotTheCouchForTheCushionOnItThatWasFittedDownToTheFloor) {
  const PosedSuperquadric couch = Box({0.0, 2.0, 0.42}, {0.9, 0.45, 0.42});
  const PosedSuperquadric cushion = Box({0.1, 2.0, 0.4}, {0.2, 0.1, 0.4});
  std::vector<std::pair<std::int64_t, Eigen::Vector3d>> points;
  for (int i = 0; i < 20; ++i) {
    points.emplace_back(i, Eigen::Vector3d(0.02 * i - 0.1, 1.9, i == 0 ? 0.1 : 0.45 + 0.015 * i));
  }
  EXPECT_TRUE(MayHide(couch, cushion, {}));
  EXPECT_FALSE(MayHide(couch, cushion, points));
}

TEST(MayHide, IsTheTableForTheChairButNotForTheCupOnIt) {
  EXPECT_TRUE(MayHide(Table(), Box({0.1, 2.8, 0.75}, {0.2, 0.05, 0.15}), {}));
  EXPECT_TRUE(MayHide(Table(), Box({0.1, 2.4, 0.5}, {0.2, 0.05, 0.3}), {}));  // pushed under it
  EXPECT_FALSE(MayHide(Table(), Box({0.1, 2.2, kTableTop + 0.05}, {0.04, 0.04, 0.05}), {}));
  EXPECT_FALSE(MayHide(Box({0.0, 0.0, 0.0}, {0.1, 0.1, 0.1}), Table(), {}));
}

}  // namespace
}  // namespace sqslam
