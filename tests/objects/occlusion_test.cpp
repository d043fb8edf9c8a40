#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "seen_landmark.h"
#include "slam/objects/landmark_estimation.h"
#include "slam/objects/landmark_geometry.h"
#include "slam/objects/landmark_refinement.h"
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

std::array<bool, 4> HiddenBy(const PosedSuperquadric& other, const PosedSuperquadric& seen) {
  const Box2d box = *ProjectToBox(seen, Pose(), TestCamera());
  const double depth = (Pose().Inverse() * seen.T_map_object.translation).z();
  return EdgesHiddenBy(box, depth, Pose(), TestCamera(), other);
}

std::array<bool, 4> HiddenByTheTable(const PosedSuperquadric& seen) { return HiddenBy(Table(), seen); }

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

TEST(MayHide, ExcludesTableForObjectsSunkIntoItsTop) {
  EXPECT_FALSE(MayHide(Table(), Box({0.1, 2.2, kTableTop - 0.05}, {0.04, 0.04, 0.05}), {}));
}

// Its points are those above the seat, whatever the last fit.
TEST(MayHide, ExcludesCouchForCushionFittedDownToTheFloor) {
  const PosedSuperquadric couch = Box({0.0, 2.0, 0.42}, {0.9, 0.45, 0.42});
  const PosedSuperquadric cushion = Box({0.1, 2.0, 0.4}, {0.2, 0.1, 0.4});
  std::vector<std::pair<std::int64_t, Eigen::Vector3d>> points;
  for (int i = 0; i < 20; ++i) {
    points.emplace_back(i, Eigen::Vector3d(0.02 * i - 0.1, 1.9, i == 0 ? 0.1 : 0.45 + 0.015 * i));
  }
  EXPECT_TRUE(MayHide(couch, cushion, {}));
  EXPECT_FALSE(MayHide(couch, cushion, points));
}

TEST(MayHide, IncludesTableForChairButNotForCupOnIt) {
  EXPECT_TRUE(MayHide(Table(), Box({0.1, 2.8, 0.75}, {0.2, 0.05, 0.15}), {}));
  EXPECT_TRUE(MayHide(Table(), Box({0.1, 2.4, 0.5}, {0.2, 0.05, 0.3}), {}));  // pushed under it
  EXPECT_FALSE(MayHide(Table(), Box({0.1, 2.2, kTableTop + 0.05}, {0.04, 0.04, 0.05}), {}));
  EXPECT_FALSE(MayHide(Box({0.0, 0.0, 0.0}, {0.1, 0.1, 0.1}), Table(), {}));
}

// The back of a chair that is seen over a table's rim hovers above the table as a cup does.
TEST(MayHide, IncludesTableForClassesOnTheFloor) {
  const PosedSuperquadric back = Box({0.1, 2.4, kTableTop + 0.15}, {0.2, 0.05, 0.12});
  EXPECT_FALSE(MayHide(Table(), back, {}));
  EXPECT_TRUE(MayHide(Table(), back, {}, true));
  EXPECT_FALSE(MayHide(Box({0.0, 0.0, 0.0}, {0.1, 0.1, 0.1}), Table(), {}, true));
}

// Takes `fit` for an object of which the boxes show what is seen over the table's far rim. `points_y`: its
// points lie in the plane of this y; empty: it has none.
Landmark FittedBehindTheTable(const std::string& label, const PosedSuperquadric& fit, bool bottom_free,
                              std::optional<double> points_y = {}) {
  constexpr double kRim = kTableTop - 0.1;  // there
  const double top = fit.T_map_object.translation.z() + fit.shape.half_size.z();
  PosedSuperquadric shown = fit;
  shown.shape.half_size.z() = 0.5 * (top - kRim);
  shown.T_map_object.translation.z() = 0.5 * (top + kRim);
  Landmark landmark;
  for (int frame = 0; frame < 20; ++frame) {
    ObjectObservation seen = testing::ObservationOf(label, *ProjectToBox(shown, Pose(), TestCamera()), frame);
    seen.T_map_camera = Pose();
    seen.edge_free = {true, true, true, bottom_free};
    landmark.Add(seen);
  }
  for (int i = 0; points_y && i < 20; ++i) {
    const double across = fit.T_map_object.translation.x() + 0.02 * (i - 9.5);
    landmark.points.emplace_back(i, Eigen::Vector3d(across, *points_y, kTableTop + 0.1));
  }
  const ObjectOptions options;
  const ClassPriors classes = ClassPriors::Named("default");
  EstimationContext context;
  context.options = &options;
  context.classes = &classes;
  context.camera = TestCamera();
  context.surroundings.others = {Box({-1.5, 2.8, 0.4}, {0.4, 0.4, 0.4}), Table()};
  ApplyFit(landmark, {fit, 0.0, 0.0, 1e-6 * Eigen::Matrix<double, 9, 9>::Identity()}, landmark.views,
           context);
  return landmark;
}

TEST(ApplyFit, ExtendsChairUnderTheTableWhenOnlyItsBackIsSeen) {
  const PosedSuperquadric back = Box({0.1, 2.8, 0.44}, {0.22, 0.03, 0.44});
  const Landmark chair = FittedBehindTheTable("chair", back, false);
  const Eigen::Vector3d half = chair.superquadric.shape.half_size;
  EXPECT_NEAR(half.y(), 0.22 * 0.48 / 0.52, 1e-6) << "the proportions of chairs in configs/classes.yaml";
  EXPECT_NEAR(chair.superquadric.T_map_object.translation.y() + half.y(), 2.83, 1e-9) << "the back stays";
  EXPECT_NEAR(std::sqrt(chair.covariance(4, 4)), 0.2 * half.y(), 1e-3) << "as chairs vary";
  EXPECT_EQ(chair.visible.shape.half_size, back.shape.half_size);
  const ClassPriors classes = ClassPriors::Named("default");
  EXPECT_FALSE(KnownSizeOf(chair, classes)) << "what the class gave says nothing about the map's scale";
  EXPECT_TRUE(KnownSizeOf(FittedBehindTheTable("chair", back, true), classes));
}

TEST(ApplyFit, TurnsChairToTheTableWhenFittedBehindItsBack) {
  const PosedSuperquadric behind = Box({0.1, 3.0, 0.44}, {0.22, 0.2, 0.44});
  const PosedSuperquadric chair = FittedBehindTheTable("chair", behind, false, 2.8).superquadric;
  EXPECT_NEAR(chair.shape.half_size.y(), 0.22 * 0.48 / 0.52, 1e-6);
  EXPECT_NEAR(chair.T_map_object.translation.y() + chair.shape.half_size.y(), 2.8, 0.02) << "the back";
}

TEST(ApplyFit, KeepsDepthWhenSeenWholeOrOfUnknownClass) {
  const PosedSuperquadric back = Box({0.1, 2.8, 0.44}, {0.22, 0.03, 0.44});
  const auto depth = [](const Landmark& landmark) { return landmark.superquadric.shape.half_size.y(); };
  EXPECT_EQ(depth(FittedBehindTheTable("chair", back, true)), 0.03) << "its legs are seen";
  EXPECT_EQ(depth(FittedBehindTheTable("thing", back, false)), 0.03);
  const PosedSuperquadric beside = Box({1.6, 2.8, 0.44}, {0.22, 0.03, 0.44});
  EXPECT_EQ(depth(FittedBehindTheTable("chair", beside, false)), 0.03) << "nothing hides it";
  const PosedSuperquadric row = Box({0.1, 2.8, 0.44}, {0.8, 0.03, 0.44});
  EXPECT_EQ(depth(FittedBehindTheTable("chair", row, false)), 0.03) << "far wider than high: no chair";
}

// Returns the depth of the visible part of a chair of which the boxes show the back over the table's far rim.
// `classes`: the text of a file of classes.
double DepthSeenOverTheTable(const std::string& classes_text) {
  const std::filesystem::path path = std::filesystem::path(::testing::TempDir()) / "chairs.yaml";
  std::ofstream(path) << classes_text;
  const ClassPriors classes = ClassPriors::Read(path);
  const PosedSuperquadric back = Box({0.1, 2.8, 0.44}, {0.22, 0.03, 0.44});
  const PosedSuperquadric shown = StretchedTo(back, kTableTop - 0.1);
  Landmark landmark;
  landmark.estimated = true;
  landmark.visible = landmark.superquadric = shown;
  for (int frame = 0; frame < 20; ++frame) {
    const Rigid3d aside(Eigen::Quaterniond::Identity(), {0.06 * (frame - 10), 0.0, 0.01 * (frame % 5)});
    const Rigid3d pose = aside * Pose();
    ObjectObservation seen = testing::ObservationOf("chair", *ProjectToBox(shown, pose, TestCamera()), frame);
    seen.T_map_camera = pose;
    seen.edge_free = {true, true, true, false};
    landmark.Add(seen);
    const Eigen::Vector3d p(0.1 + 0.02 * (frame - 9.5), 2.77, kTableTop + 0.008 * frame);
    landmark.points.emplace_back(frame, p);
    landmark.votes[frame].SeeInside(pose.translation);
  }
  const ObjectOptions options;
  const SupportSurfaces supports = SupportSurfaces::Everywhere(0.0);
  EstimationContext context;
  context.options = &options;
  context.classes = &classes;
  context.supports = &supports;
  context.camera = TestCamera();
  context.upright = context.thorough = true;
  context.surroundings.others = {Table()};
  const StandingFit fit = *RefineLandmark(landmark, landmark.views, true, context);
  return 2.0 * fit.superquadric.shape.half_size.head<2>().minCoeff();
}

TEST(RefineLandmark, FindsChairByItsBackOverATable) {
  const std::string chair =
      "chair: {size: [0.48, 0.52, 0.88], spread: 0.2, aspect: [0.2, 0.2], box: 1, hollow: true";
  EXPECT_LT(DepthSeenOverTheTable(chair + ", floor: true, back: true}\n"), 0.12);
  EXPECT_GT(DepthSeenOverTheTable(chair + ", floor: true}\n"), 0.25) << "a whole chair";
}

}  // namespace
}  // namespace sqslam
