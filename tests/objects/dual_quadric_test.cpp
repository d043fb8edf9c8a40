#include "slam/objects/dual_quadric.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "slam/geometry/solid_iou.h"
#include "slam/objects/landmark_geometry.h"
#include "test_camera.h"

namespace sqslam {
namespace {

using testing::TestCamera;

PosedSuperquadric LeaningEllipsoid() {
  PosedSuperquadric ellipsoid;
  ellipsoid.shape = {{0.3, 0.2, 0.12}, 1.0, 1.0};
  ellipsoid.T_map_object.rotation = Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized());
  ellipsoid.T_map_object.translation = {1.0, -2.0, 0.5};
  return ellipsoid;
}

// The box around the part of the ellipsoid that lies in the image, by many points of its surface.
Box2d BoxOfVisiblePart(const PosedSuperquadric& ellipsoid, const Rigid3d& T_map_camera,
                       const Camera& camera) {
  Eigen::Vector2d low(1e9, 1e9);
  Eigen::Vector2d high(-1e9, -1e9);
  for (int i = 0; i < 400; ++i) {
    for (int j = 0; j < 800; ++j) {
      const Eigen::Vector3d p = ellipsoid.shape.PointAt(std::numbers::pi * (i / 399.0 - 0.5),
                                                        std::numbers::pi * (2.0 * j / 799.0 - 1.0));
      const Eigen::Vector2d pixel = camera.Project(T_map_camera.Inverse() * (ellipsoid.T_map_object * p));
      if (Box2d{0.0, 0.0, 640.0, 480.0}.Contains(pixel)) {
        low = low.cwiseMin(pixel);
        high = high.cwiseMax(pixel);
      }
    }
  }
  return {low.x(), low.y(), high.x() - low.x(), high.y() - low.y()};
}

// The camera at `centre`, looking at `target`, with the image's up near the map's z.
Rigid3d LookAt(const Eigen::Vector3d& centre, const Eigen::Vector3d& target) {
  const Eigen::Vector3d z = (target - centre).normalized();
  const Eigen::Vector3d x = z.cross(Eigen::Vector3d::UnitZ()).normalized();
  Eigen::Matrix3d R;
  R << x, z.cross(x), z;
  return {Eigen::Quaterniond(R), centre};
}

// Half a circle around the ellipsoid at different heights.
std::vector<Rigid3d> ArcOfPoses(const Eigen::Vector3d& target, int count = 12) {
  std::vector<Rigid3d> poses;
  for (int i = 0; i < count; ++i) {
    const double angle = std::numbers::pi * i / count;
    const Eigen::Vector3d offset(2.0 * std::cos(angle), 2.0 * std::sin(angle), 0.5 + 0.4 * (i % 3));
    poses.push_back(LookAt(target + offset, target));
  }
  return poses;
}

// Exact boxes, by the silhouettes of superquadrics and not by conics.
std::vector<BoxView> ViewsFrom(const PosedSuperquadric& object, const std::vector<Rigid3d>& poses,
                               const Camera& camera) {
  std::vector<BoxView> views;
  for (const Rigid3d& pose : poses) {
    views.push_back({static_cast<std::int64_t>(views.size()),
                     pose,
                     ProjectToBox(object, pose, camera).value(),
                     {true, true, true, true}});
  }
  return views;
}

double Overlap(const PosedSuperquadric& a, const PosedSuperquadric& b) {
  return IoU(Solid::FromSuperquadric(a), Solid::FromSuperquadric(b));
}

TEST(DualQuadric, VanishesOnTangentPlanesAndGivesTheEllipsoidBack) {
  const PosedSuperquadric ellipsoid = LeaningEllipsoid();
  const Eigen::Matrix4d Q = DualQuadricOf(ellipsoid);
  for (const double eta : {-1.2, -0.3, 0.4, 1.1}) {
    for (const double omega : {-2.5, -0.7, 0.9, 2.2}) {
      const Eigen::Vector3d p = ellipsoid.T_map_object * ellipsoid.shape.PointAt(eta, omega);
      const Eigen::Vector3d n = ellipsoid.T_map_object.rotation * ellipsoid.shape.NormalAt(eta, omega);
      Eigen::Vector4d plane;
      plane << n, -n.dot(p);
      EXPECT_NEAR(plane.dot(Q * plane), 0.0, 1e-12);
    }
  }
  const auto back = EllipsoidOf(-7.0 * Q);
  ASSERT_TRUE(back);
  EXPECT_TRUE(DualQuadricOf(*back).isApprox(Q, 1e-9));
  EXPECT_GT((back->T_map_object.rotation * Eigen::Vector3d::UnitZ()).z(), std::sqrt(1.0 / 3.0));
}

TEST(DualQuadric, RejectsOtherKindsOfQuadrics) {
  EXPECT_FALSE(EllipsoidOf(Eigen::Vector4d(1.0, 1.0, -0.2, -1.0).asDiagonal()));  // a hyperboloid
  EXPECT_FALSE(EllipsoidOf(Eigen::Vector4d(1.0, 1.0, 0.0, -1.0).asDiagonal()));   // a disc
  EXPECT_FALSE(EllipsoidOf(Eigen::Vector4d(1.0, 1.0, 1.0, 0.0).asDiagonal()));    // centre at infinity
}

TEST(EstimateDualQuadric, RecoversAnEllipsoidFromExactBoxes) {
  const PosedSuperquadric truth = LeaningEllipsoid();
  const auto views = ViewsFrom(truth, ArcOfPoses(truth.T_map_object.translation), TestCamera());
  const auto estimate = EstimateDualQuadric(views, TestCamera(), ObjectOptions());
  ASSERT_TRUE(estimate);
  EXPECT_LT((DualQuadricOf(*estimate) - DualQuadricOf(truth)).norm(), 1e-4);
  EXPECT_EQ(estimate->shape.e1, 1.0);
  EXPECT_EQ(estimate->shape.e2, 1.0);
}

TEST(EstimateDualQuadric, UsesVisibleEdgesOfBoxesCutOffByTheImage) {
  Camera camera = TestCamera();
  const PosedSuperquadric truth = LeaningEllipsoid();
  auto views = ViewsFrom(truth, ArcOfPoses(truth.T_map_object.translation), camera);
  for (std::size_t i = 0; i < views.size(); i += 2) {  // turned away until a third is out of sight
    const double out = 0.35 * views[i].box.width + views[i].box.x;
    Rigid3d& pose = views[i].T_map_camera;
    pose.rotation = pose.rotation * Eigen::AngleAxisd(std::atan(out / camera.fx), Eigen::Vector3d::UnitY());
    views[i].box = BoxOfVisiblePart(truth, pose, camera);
    ASSERT_LT(views[i].box.x, 1.0);
    views[i].edge_free[0] = false;
  }
  const auto estimate = EstimateDualQuadric(views, camera, ObjectOptions());
  ASSERT_TRUE(estimate);
  EXPECT_GT(Overlap(*estimate, truth), 0.98);
}

TEST(EstimateDualQuadric, IgnoresHiddenEdges) {
  const PosedSuperquadric truth = LeaningEllipsoid();
  auto views = ViewsFrom(truth, ArcOfPoses(truth.T_map_object.translation), TestCamera());
  for (std::size_t i = 0; i < views.size(); i += 3) {
    views[i].box.height *= 0.6;
    views[i].edge_free[3] = false;
  }
  const auto estimate = EstimateDualQuadric(views, TestCamera(), ObjectOptions());
  ASSERT_TRUE(estimate);
  EXPECT_GT(Overlap(*estimate, truth), 0.995);  // as exact as the overlap is measured
}

TEST(EstimateDualQuadric, StaysNearTheTruthWithNoisyBoxesAndOutliers) {
  const PosedSuperquadric truth = LeaningEllipsoid();
  auto views = ViewsFrom(truth, ArcOfPoses(truth.T_map_object.translation, 60), TestCamera());
  std::mt19937_64 random(7);
  std::normal_distribution<double> noise(0.0, 1.0);
  for (BoxView& view : views) {
    view.box.x += noise(random);
    view.box.y += noise(random);
    view.box.width += noise(random);
    view.box.height += noise(random);
  }
  views[10].box.width *= 1.6;
  views[33].box.height *= 0.5;
  const auto estimate = EstimateDualQuadric(views, TestCamera(), ObjectOptions());
  ASSERT_TRUE(estimate);
  EXPECT_GT(Overlap(*estimate, truth), 0.9);
}

TEST(EstimateDualQuadric, CommutesWithSimilarities) {
  const Sim3d move{3.7,
                   Eigen::Quaterniond(Eigen::AngleAxisd(2.0, Eigen::Vector3d(1, -2, 1).normalized())),
                   {30.0, -4.0, 12.0}};
  PosedSuperquadric box = LeaningEllipsoid();  // no ellipsoid: its boxes do not fit any quadric exactly
  box.shape.e1 = box.shape.e2 = 0.3;
  auto views = ViewsFrom(box, ArcOfPoses(box.T_map_object.translation), TestCamera());
  const auto before = EstimateDualQuadric(views, TestCamera(), ObjectOptions());
  for (BoxView& view : views) {
    view.T_map_camera = {move.rotation * view.T_map_camera.rotation, move * view.T_map_camera.translation};
  }
  const auto after = EstimateDualQuadric(views, TestCamera(), ObjectOptions());
  ASSERT_TRUE(before && after);
  const Eigen::Matrix4d M = move.Matrix();
  const Eigen::Matrix4d expected = M * DualQuadricOf(*before) * M.transpose();
  EXPECT_TRUE(DualQuadricOf(*after).isApprox(expected, 1e-6));
}

TEST(EstimateDualQuadric, RefusesFewerThanThreeViews) {
  const PosedSuperquadric truth = LeaningEllipsoid();
  auto views = ViewsFrom(truth, ArcOfPoses(truth.T_map_object.translation), TestCamera());
  views.resize(2);
  EXPECT_FALSE(EstimateDualQuadric(views, TestCamera(), ObjectOptions()));
  EXPECT_FALSE(EstimateDualQuadric({}, TestCamera(), ObjectOptions()));
}

TEST(EstimateDualQuadric, RefusesViewsAlongOneLine) {
  const PosedSuperquadric truth = LeaningEllipsoid();
  const Eigen::Vector3d& target = truth.T_map_object.translation;
  const Rigid3d first = LookAt(target + Eigen::Vector3d(2.0, -1.0, 1.0), target);
  std::vector<Rigid3d> sideways;
  std::vector<Rigid3d> forward;
  for (int i = 0; i < 12; ++i) {
    const Eigen::Vector3d right = first.rotation * Eigen::Vector3d::UnitX();
    const Eigen::Vector3d ahead = first.rotation * Eigen::Vector3d::UnitZ();
    sideways.push_back({first.rotation, first.translation + 0.05 * (i - 6) * right});
    forward.push_back({first.rotation, first.translation + 0.08 * i * ahead});
  }
  EXPECT_FALSE(EstimateDualQuadric(ViewsFrom(truth, sideways, TestCamera()), TestCamera(), ObjectOptions()));
  EXPECT_FALSE(EstimateDualQuadric(ViewsFrom(truth, forward, TestCamera()), TestCamera(), ObjectOptions()));
}

TEST(EstimateDualQuadric, RefusesPureRotation) {
  const PosedSuperquadric truth = LeaningEllipsoid();
  const Eigen::Vector3d& target = truth.T_map_object.translation;
  const Rigid3d first = LookAt(target + Eigen::Vector3d(2.0, -1.0, 1.0), target);
  std::vector<Rigid3d> turning;
  for (int i = 0; i < 12; ++i) {
    turning.push_back(first);
    turning.back().rotation =
        first.rotation * Eigen::AngleAxisd(0.02 * (i - 6), Eigen::Vector3d(1, 1, i % 3).normalized());
  }
  EXPECT_FALSE(EstimateDualQuadric(ViewsFrom(truth, turning, TestCamera()), TestCamera(), ObjectOptions()));
}

}  // namespace
}  // namespace sqslam
