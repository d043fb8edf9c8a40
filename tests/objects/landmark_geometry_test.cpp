#include "slam/objects/landmark_geometry.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>

#include "slam/geometry/angles.h"
#include "slam/objects/landmark_estimation.h"
#include "synthetic_desk.h"

namespace sqslam {
namespace {

using testing::SyntheticDesk;

TEST(ProjectToBox, EnclosesTheProjectedSurfaceTightly) {
  const SyntheticDesk desk(1);
  const Rigid3d T_camera_map = desk.Pose(20).Inverse();
  for (const SyntheticDesk::Object& object : desk.Objects()) {
    const auto box = ProjectToBox(object.superquadric, desk.Pose(20), desk.Camera());
    ASSERT_TRUE(box);
    Eigen::Vector2d low(1e9, 1e9);
    Eigen::Vector2d high(-1e9, -1e9);
    for (int i = 0; i < 160; ++i) {
      for (int j = 0; j < 320; ++j) {
        const Eigen::Vector3d p =
            object.superquadric.shape.PointAt(-M_PI / 2 + M_PI * i / 159, -M_PI + 2 * M_PI * j / 319);
        const Eigen::Vector2d pixel =
            desk.Camera().Project(T_camera_map * (object.superquadric.T_map_object * p));
        low = low.cwiseMin(pixel);
        high = high.cwiseMax(pixel);
      }
    }
    EXPECT_NEAR(box->x, low.x(), 0.7);
    EXPECT_NEAR(box->y, low.y(), 0.7);
    EXPECT_NEAR(box->x + box->width, high.x(), 0.7);
    EXPECT_NEAR(box->y + box->height, high.y(), 0.7);
  }
}

// Samples of the surface reach the box from within; the finer, the nearer.
TEST(ProjectToBox, HoldsForAllShapesFromAllSides) {
  const Camera camera = SyntheticDesk(1).Camera();
  std::mt19937 generator(3);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int trial = 0; trial < 60; ++trial) {
    PosedSuperquadric s;
    s.shape = {{0.2 + 0.15 * unit(generator), 0.2 + 0.19 * unit(generator), 0.2 + 0.1 * unit(generator)},
               1.0 + 0.9 * unit(generator),
               1.0 + 0.9 * unit(generator)};
    const Eigen::Vector3d axis(unit(generator), unit(generator), unit(generator));
    s.T_map_object = {Eigen::Quaterniond(Eigen::AngleAxisd(3.0 * unit(generator), axis.normalized())),
                      {0.5 * unit(generator), 0.5 * unit(generator), 2.0}};
    const auto box = ProjectToBox(s, Rigid3d(), camera);
    ASSERT_TRUE(box);
    Eigen::Vector2d low(1e9, 1e9);
    Eigen::Vector2d high(-1e9, -1e9);
    for (int i = 0; i <= 150; ++i) {
      for (int j = 0; j < 300; ++j) {
        const Eigen::Vector3d p = s.shape.PointAt(-M_PI / 2 + M_PI * i / 150, -M_PI + 2 * M_PI * j / 300);
        const Eigen::Vector2d pixel = camera.Project(s.T_map_object * p);
        low = low.cwiseMin(pixel);
        high = high.cwiseMax(pixel);
      }
    }
    const double gap = 0.02 * std::max(box->width, box->height);
    for (const double beyond : {low.x() - box->x, low.y() - box->y, box->x + box->width - high.x(),
                                box->y + box->height - high.y()}) {
      EXPECT_GT(beyond, -0.01) << trial << " e " << s.shape.e1 << " " << s.shape.e2;
      EXPECT_LT(beyond, gap) << trial << " e " << s.shape.e1 << " " << s.shape.e2;
    }
  }
}

TEST(ProjectToBox, RefusesSolidsBehindTheCamera) {
  PosedSuperquadric s;
  s.T_map_object.translation = {0, 0, -3};
  EXPECT_FALSE(ProjectToBox(s, Rigid3d(), SyntheticDesk(1).Camera()));
  s.T_map_object.translation = {0, 0, 0.5};  // the camera is inside
  EXPECT_FALSE(ProjectToBox(s, Rigid3d(), SyntheticDesk(1).Camera()));
}

TEST(DistortBox, UndoesUndistortBox) {
  Camera camera = SyntheticDesk(1).Camera();
  camera.distortion = {-0.2, 0.05, 0.001, -0.002, 0.0};
  const Box2d box{40, 50, 200, 150};
  const Box2d straight = UndistortBox(box, camera);
  EXPECT_GT(std::abs(straight.x - box.x), 2.0);
  const Box2d back = DistortBox(straight, camera);
  EXPECT_NEAR(back.x, box.x, 0.5);
  EXPECT_NEAR(back.y, box.y, 0.5);
  EXPECT_NEAR(back.x + back.width, box.x + box.width, 0.5);
  EXPECT_NEAR(back.y + back.height, box.y + box.height, 0.5);
}

TEST(BoxAgreement, IgnoresHiddenParts) {
  const SyntheticDesk desk(1);
  const PosedSuperquadric whole = desk.Objects()[5].superquadric;
  std::vector<BoxView> views;
  for (int frame = 0; frame < SyntheticDesk::kFrames; frame += 10) {
    Box2d box = *ProjectToBox(whole, desk.Pose(frame), desk.Camera());
    box.height *= 0.6;  // the rest is behind a table
    views.push_back({frame, desk.Pose(frame), box, {true, true, true, false}});
  }
  EXPECT_GT(BoxAgreement(whole, views, desk.Camera()), 0.98);
  for (BoxView& view : views) {
    view.edge_free[3] = true;
  }
  EXPECT_LT(BoxAgreement(whole, views, desk.Camera()), 0.7);
}

TEST(MayBeInView, NeverRejectsVisibleSolidsAndRejectsMostOthers) {
  const Camera camera = SyntheticDesk(1).Camera();
  PosedSuperquadric s;
  s.shape = {{0.1, 0.2, 0.05}, 0.3, 0.7};
  int seen = 0;
  int denied = 0;
  for (int i = 0; i < 4000; ++i) {
    s.T_map_object.translation = {-2.0 + 0.2 * (i % 20), -2.0 + 0.2 * (i / 20 % 20), 0.3 + 0.25 * (i / 400)};
    const auto box = ProjectToBox(s, Rigid3d(), camera);
    const bool in_image = box && ClipToImage(*box, camera).Area() > 0.0;
    const bool maybe = MayBeInView(s, Rigid3d(), camera);
    EXPECT_TRUE(maybe || !in_image);
    seen += in_image ? 1 : 0;
    denied += maybe ? 0 : 1;
  }
  EXPECT_GT(seen, 400);
  EXPECT_GT(denied, (4000 - seen) / 2);
}

TEST(OverlapOfSmaller, EqualsOneInsideAndZeroApart) {
  PosedSuperquadric large;
  large.shape = {{1, 1, 1}, 1.0, 1.0};
  PosedSuperquadric small;
  small.shape = {{0.2, 0.2, 0.2}, 0.1, 0.1};
  EXPECT_DOUBLE_EQ(OverlapOfSmaller(large, small), 1.0);
  EXPECT_DOUBLE_EQ(OverlapOfSmaller(small, large), 1.0);
  small.T_map_object.translation = {3, 0, 0};
  EXPECT_DOUBLE_EQ(OverlapOfSmaller(large, small), 0.0);
}

}  // namespace
}  // namespace sqslam
