#include "slam/fitting/fixed_shape_fit.h"

#include <gtest/gtest.h>

#include <vector>

namespace sqslam {
namespace {

PosedSuperquadric Solid(double e) {
  PosedSuperquadric solid;
  solid.shape = {{0.3, 0.2, 0.15}, e, e};
  solid.T_map_object = {Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitZ())),
                        {1.0, -2.0, 0.5}};
  return solid;
}

std::vector<Eigen::Vector3d> SurfacePoints(const PosedSuperquadric& solid, double first_eta) {
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 12; ++i) {
    for (int j = 0; j < 24; ++j) {
      const double eta = first_eta + (1.5 - first_eta) * i / 11.0;
      points.push_back(solid.T_map_object * solid.shape.PointAt(eta, -3.0 + 0.25 * j));
    }
  }
  return points;
}

TEST(FixedShapeFitTest, RecoversCentreAndSize) {
  for (const double e : {0.1, 0.5, 1.0, 1.5}) {
    const PosedSuperquadric truth = Solid(e);
    PosedSuperquadric start = truth;
    start.shape.half_size = start.shape.half_size.cwiseProduct(Eigen::Vector3d(1.15, 0.85, 1.1));
    start.T_map_object.translation += Eigen::Vector3d(0.02, -0.02, 0.01);
    const PosedSuperquadric fitted = FitPlaceAndSize(SurfacePoints(truth, -1.5), start);
    EXPECT_LT((fitted.shape.half_size - truth.shape.half_size).cwiseAbs().maxCoeff(), 3e-3) << e;
    EXPECT_LT((fitted.T_map_object.translation - truth.T_map_object.translation).norm(), 3e-3) << e;
    EXPECT_EQ(fitted.shape.e1, e);
    EXPECT_LT(fitted.T_map_object.rotation.angularDistance(truth.T_map_object.rotation), 1e-12);
  }
}

TEST(FixedShapeFitTest, GrowsEllipsoidToSidesOfBox) {
  PosedSuperquadric start = Solid(0.1);
  const std::vector<Eigen::Vector3d> points = SurfacePoints(start, -1.5);
  start.shape.e1 = start.shape.e2 = 1.0;
  const PosedSuperquadric fitted = FitPlaceAndSize(points, start);
  EXPECT_GT(fitted.shape.Volume(), 1.15 * start.shape.Volume());
}

TEST(FixedShapeFitTest, KeepsUnobservedSides) {
  const PosedSuperquadric truth = Solid(0.2);
  const PosedSuperquadric fitted = FitPlaceAndSize(SurfacePoints(truth, 0.6), truth);  // the top only
  EXPECT_NEAR(fitted.shape.half_size.z(), 0.15, 0.015);
  EXPECT_NEAR(fitted.T_map_object.translation.z(), 0.5, 0.015);
}

TEST(FixedShapeFitTest, KeepsLowerHalfOfBallSeenFromAbove) {
  PosedSuperquadric ball;
  ball.shape = {{0.2, 0.2, 0.2}, 1.0, 1.0};
  std::vector<Eigen::Vector3d> points = SurfacePoints(ball, 0.2);
  for (std::size_t i = 0; i < points.size(); ++i) {  // flatter than the ball, as if depth were too small
    points[i].z() *= i % 2 == 0 ? 0.95 : 0.85;
  }
  points.resize(40);
  const PosedSuperquadric fitted = FitPlaceAndSize(points, ball);
  const double lower = fitted.T_map_object.translation.z() - fitted.shape.half_size.z();
  EXPECT_NEAR(lower, -0.2, 0.02);
}

TEST(FixedShapeFitTest, RecoversYawWhenFree) {
  const PosedSuperquadric truth = Solid(0.2);
  PosedSuperquadric start = truth;
  start.T_map_object.rotation =
      start.T_map_object.rotation * Eigen::AngleAxisd(-0.15, Eigen::Vector3d::UnitZ());
  start.T_map_object.translation += Eigen::Vector3d(0.01, 0.01, 0.0);
  const std::vector<Eigen::Vector3d> points = SurfacePoints(truth, -1.5);
  const auto turn = [&](const PosedSuperquadric& fitted) {
    return fitted.T_map_object.rotation.angularDistance(truth.T_map_object.rotation);
  };
  const PosedSuperquadric turned = FitPlaceAndSize(points, start, {.yaw = true});
  EXPECT_LT(turn(turned), 5e-3);
  EXPECT_LT((turned.T_map_object.translation - truth.T_map_object.translation).norm(), 5e-3);
  const PosedSuperquadric held = FitPlaceAndSize(points, start);
  EXPECT_NEAR(turn(held), 0.15, 1e-9);
  EXPECT_LT(10.0 * MeanPointCost(points, turned, 0.2), MeanPointCost(points, held, 0.2));
}

TEST(FixedShapeFitTest, KeepsRoundShapeRound) {
  PosedSuperquadric can;
  can.shape = {{0.2, 0.2, 0.3}, 0.1, 1.0};
  std::vector<Eigen::Vector3d> points;
  for (const Eigen::Vector3d& p : SurfacePoints(can, -1.5)) {
    if (p.y() < 0.0) {  // one half is seen
      points.push_back(p);
    }
  }
  PosedSuperquadric start = can;
  start.shape.half_size = {0.17, 0.17, 0.33};
  const PosedSuperquadric fitted = FitPlaceAndSize(points, start, {.round = true});
  EXPECT_EQ(fitted.shape.half_size.x(), fitted.shape.half_size.y());
  EXPECT_NEAR(fitted.shape.half_size.x(), 0.2, 0.01);
  EXPECT_NEAR(fitted.shape.half_size.z(), 0.3, 0.01);
}

TEST(FixedShapeFitTest, ReturnsStartWithoutPoints) {
  const PosedSuperquadric start = Solid(0.7);
  EXPECT_EQ(FitPlaceAndSize({}, start).shape.half_size, start.shape.half_size);
}

}  // namespace
}  // namespace sqslam
