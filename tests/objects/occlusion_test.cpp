#include <gtest/gtest.h>

#include "flat_surface.h"
#include "seen_landmark.h"
#include "slam/objects/landmark_estimation.h"
#include "slam/objects/landmark_geometry.h"
#include "slam/objects/landmark_refinement.h"
#include "table_scene.h"
#include "test_camera.h"
#include "tests/io/temporary_folder.h"

namespace sqslam {
namespace {

using testing::Box;
using testing::kTableTop;
using testing::Pose;
using testing::Table;
using testing::TestCamera;

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
  const ClassTable classes = ClassTable::Named("default");
  EstimationContext context;
  context.options = &options;
  context.classes = &classes;
  context.camera = TestCamera();
  context.surroundings.others = {Box({-1.5, 2.8, 0.4}, {0.4, 0.4, 0.4}), Table()};
  ApplyFit(landmark, {{fit, 0.0, 1e-6 * Eigen::Matrix<double, 9, 9>::Identity()}, {.support = 0.0}},
           landmark.views, context);
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
  const ClassTable classes = ClassTable::Named("default");
  EXPECT_FALSE(ScaleFrom(chair, classes)) << "what the class gave says nothing about the map's scale";
  EXPECT_TRUE(ScaleFrom(FittedBehindTheTable("chair", back, true), classes));
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
  const TemporaryFolder folder;
  const ClassTable classes = ClassTable::Named(folder.Write("chairs.yaml", classes_text));
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
  const SupportSurfaces supports = testing::FlatSurface(0.0);
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
