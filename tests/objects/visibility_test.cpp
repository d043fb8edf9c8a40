#include "slam/objects/visibility.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "slam/objects/landmark_geometry.h"
#include "table_scene.h"
#include "test_camera.h"

namespace sqslam {
namespace {

using testing::Box;
using ::testing::ElementsAre;
using testing::kTableTop;
using testing::Pose;
using testing::Table;
using testing::TestCamera;

EdgeFlags HiddenBy(const PosedSuperquadric& other, const PosedSuperquadric& seen) {
  const Box2d box = *ProjectToBox(seen, Pose(), TestCamera());
  return EdgesHiddenBy(other, seen, box, Pose(), TestCamera());
}

EdgeFlags HiddenByTheTable(const PosedSuperquadric& seen) { return HiddenBy(Table(), seen); }

TEST(EdgesHiddenBy, HidesLegsOfAChairBehindATable) {
  EXPECT_THAT(HiddenByTheTable(Box({0.1, 2.8, 0.75}, {0.2, 0.05, 0.15})),
              ElementsAre(false, false, false, true));
}

TEST(EdgesHiddenBy, HidesNothingBesideOrInFront) {
  EXPECT_THAT(HiddenByTheTable(Box({1.6, 2.8, 0.75}, {0.2, 0.05, 0.15})),
              ElementsAre(false, false, false, false));
  EXPECT_THAT(HiddenByTheTable(Box({0.0, 1.2, 0.5}, {0.1, 0.05, 0.15})),
              ElementsAre(false, false, false, false));
}

TEST(EdgesHiddenBy, HidesBehindTheHullOfAChairNotBesideIt) {
  const PosedSuperquadric cup = Box({0.06, 1.95, 0.75}, {0.04, 0.04, 0.05});
  const Eigen::Vector3d half_size(0.23, 0.26, 0.45);
  EXPECT_THAT(HiddenBy(Box({-0.22, 1.96, 0.45}, half_size), cup), ElementsAre(false, false, false, false));
  EXPECT_THAT(HiddenBy(Box({-0.22, 1.3, 0.45}, half_size), cup), ElementsAre(true, false, false, false));
}

TEST(EdgesHiddenBy, HidesNothingAtTheRimOfATableEstimatedTooHigh) {
  // A cup that stands 2 cm deep in the table, a hand's breadth before the far rim.
  const PosedSuperquadric cup = Box({0.1, 2.42, kTableTop + 0.03}, {0.04, 0.04, 0.05});
  EXPECT_THAT(HiddenByTheTable(cup), ElementsAre(false, false, false, false));
}

TEST(EdgesHiddenBy, HidesNoTopAloneByObjectsOnTheFloor) {
  const PosedSuperquadric chair = Box({0.1, 2.8, 0.7}, {0.22, 0.2, 0.18});
  const Eigen::Vector3d half_size(0.6, 0.6, 0.5);  // far too large, and where the chair is
  EXPECT_FALSE(HiddenBy(Box({-0.1, 2.6, 0.5}, half_size), chair)[kTopEdge]);
  EXPECT_TRUE(HiddenBy(Box({0.1, 1.8, 1.1}, {0.5, 0.1, 0.22}), chair)[kTopEdge]) << "a lamp does";
}

// A screen on a desk rises above the desk's far edge, so that the desk's box covers only its lower edge.
TEST(JudgeHiddenEdges, FreesEdgesAboveAMappedObject) {
  const Camera camera = TestCamera();
  const PosedSuperquadric screen = Box({0.1, 2.2, kTableTop + 0.2}, {0.3, 0.05, 0.2});
  BoxView view{7, Pose(), *ProjectToBox(screen, Pose(), camera), {true, true, true, false}};
  Landmark desk;
  desk.views.push_back({7, Pose(), *ProjectToBox(Table(), Pose(), camera), {}});
  const auto judged = [&](const Landmark& larger, std::span<const PosedSuperquadric> occluders) {
    std::vector<BoxView> views = {view};
    const Landmark* const pointer = &larger;
    JudgeHiddenEdges(screen, {&pointer, 1}, occluders, camera, DetectionFilterOptions(), views);
    return views.front().edge_free;
  };
  EXPECT_THAT(judged(desk, {}), ElementsAre(true, true, true, true));
  const PosedSuperquadric shelf = Box({0.1, 1.6, 0.45}, {0.8, 0.1, 0.45});  // between it and the camera
  EXPECT_FALSE(judged(desk, {&shelf, 1})[kBottomEdge]) << "hidden by a solid";
  desk.views.front().frame_index = 8;
  EXPECT_FALSE(judged(desk, {})[kBottomEdge]) << "something unknown hides it";
  desk.views.front().frame_index = 7;
  view.box.height = camera.height - view.box.y;
  EXPECT_FALSE(judged(desk, {})[kBottomEdge]) << "cut off by the image";
}

TEST(MayOcclude, ExcludesTableForObjectsSunkIntoItsTop) {
  EXPECT_FALSE(MayOcclude(Table(), Box({0.1, 2.2, kTableTop - 0.05}, {0.04, 0.04, 0.05})));
}

TEST(MayOcclude, IncludesTableForChairButNotForCupOnIt) {
  EXPECT_TRUE(MayOcclude(Table(), Box({0.1, 2.8, 0.75}, {0.2, 0.05, 0.15})));
  EXPECT_TRUE(MayOcclude(Table(), Box({0.1, 2.4, 0.5}, {0.2, 0.05, 0.3})));  // pushed under it
  EXPECT_FALSE(MayOcclude(Table(), Box({0.1, 2.2, kTableTop + 0.05}, {0.04, 0.04, 0.05})));
  EXPECT_FALSE(MayOcclude(Box({0.0, 0.0, 0.0}, {0.1, 0.1, 0.1}), Table()));
}

// The back of a chair that is seen over a table's rim hovers above the table as a cup does.
TEST(MayOcclude, IncludesTableForClassesOnTheFloor) {
  const PosedSuperquadric back = Box({0.1, 2.4, kTableTop + 0.15}, {0.2, 0.05, 0.12});
  EXPECT_FALSE(MayOcclude(Table(), back));
  EXPECT_TRUE(MayOcclude(Table(), back, true));
  EXPECT_FALSE(MayOcclude(Box({0.0, 0.0, 0.0}, {0.1, 0.1, 0.1}), Table(), true));
}

TEST(BoxEdges, FreesEdgesNeitherCutNorHidden) {
  BoxEdges edges{.cut = {true, false, false, false}};
  edges.Hide({true, false, false, false});
  edges.Hide({false, true, false, false});
  EXPECT_THAT(edges.Free(), ElementsAre(false, false, true, true));
  EXPECT_TRUE(edges.AnyCut());
}

TEST(IsBottomSeen, NeedsAThirdOfTheViews) {
  std::vector<BoxView> views(9);
  for (BoxView& view : views) {
    view.edge_free = {true, true, true, false};
  }
  views[0].edge_free[3] = views[1].edge_free[3] = true;
  EXPECT_FALSE(IsBottomSeen(views));
  views[2].edge_free[3] = true;
  EXPECT_TRUE(IsBottomSeen(views));
}

}  // namespace
}  // namespace sqslam
