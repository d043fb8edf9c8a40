#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "app/viewer/model/annotation.h"
#include "app/viewer/model/annotation_points.h"
#include "tests/io/temporary_folder.h"

namespace sqslam::viewer {
namespace {

using Eigen::Vector3d;

Solid Truth(SolidKind kind, double yaw) {
  Solid solid = UprightSolid(kind, {2.0, -1.0, 0.4}, yaw, {0.3, 0.15, 0.2});
  if (kind == SolidKind::kCylinder) {
    solid.half_size.head<2>().setConstant(0.15);
  } else if (kind == SolidKind::kSuperquadric) {
    solid.e1 = 0.5;
    solid.e2 = 0.4;
  }
  return solid;
}

// Points of the surface that the eye sees, with noise: rays towards random places of the solid.
std::vector<Vector3d> SeenPoints(const Solid& solid, const Vector3d& eye, int count, double noise) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> error(0.0, noise);
  std::uniform_real_distribution<double> place(-1.0, 1.0);
  const Vector3d eye_object = solid.T_map_object.Inverse() * eye;
  std::vector<Vector3d> points;
  while (static_cast<int>(points.size()) < count) {
    const Vector3d target =
        Vector3d(place(random), place(random), place(random)).cwiseProduct(solid.half_size);
    const Vector3d direction = target - eye_object;
    double outside = 0.0;
    for (double t = 0.0; t < 2.0; t += 1e-3) {
      if (solid.RadialScale(eye_object + t * direction) <= 1.0) {
        points.push_back(solid.T_map_object * (eye_object + 0.5 * (t + outside) * direction) +
                         Vector3d(error(random), error(random), error(random)));
        break;
      }
      outside = t;
    }
  }
  return points;
}

double WorstSize(const Solid& a, const Solid& b) { return (a.half_size - b.half_size).cwiseAbs().maxCoeff(); }

TEST(PrimitiveFit, FindsEachKindFromTwoViews) {
  for (const SolidKind kind :
       {SolidKind::kCuboid, SolidKind::kCylinder, SolidKind::kEllipsoid, SolidKind::kSuperquadric}) {
    for (const double yaw : {-0.7, 0.0, 0.35, 0.75}) {
      const Solid truth = Truth(kind, yaw);
      std::vector<Vector3d> points = SeenPoints(truth, {2.0, -3.0, 1.5}, 150, 0.002);
      const auto more = SeenPoints(truth, {4.0, 0.0, 1.5}, 150, 0.002);
      points.insert(points.end(), more.begin(), more.end());
      const PrimitiveFit fit = FitPrimitive(points, kind, {.round = true, .ground = 0.2});
      EXPECT_EQ(fit.solid.kind, kind);
      EXPECT_EQ(fit.points, 300);
      EXPECT_GT(IoU(fit.solid, truth), kind == SolidKind::kSuperquadric ? 0.85 : 0.9)
          << NameOf(kind) << " " << yaw;
      EXPECT_LT(fit.rms, 0.012) << NameOf(kind) << " " << yaw;
      EXPECT_NEAR(BottomOf(fit.solid), 0.2, 1e-9);
    }
  }
}

TEST(PrimitiveFit, AlignsCuboidYawWithItsSides) {
  for (const double degrees : {-40.0, -20.0, 0.0, 10.0, 44.0}) {
    const double yaw = degrees * 0.0174532925;
    const Solid truth = Truth(SolidKind::kCuboid, yaw);
    std::vector<Vector3d> points = SeenPoints(truth, {3.0, -3.0, 2.0}, 300, 0.001);
    const PrimitiveFit fit = FitPrimitive(points, SolidKind::kCuboid);
    EXPECT_NEAR(YawOf(fit.solid) / 0.0174532925, degrees, 1.0);
    EXPECT_LT(WorstSize(fit.solid, truth), 0.03) << degrees << ": " << fit.solid.half_size.transpose();
  }
}

TEST(PrimitiveFit, KeepsYawWithin45Degrees) {
  const Solid truth = Truth(SolidKind::kCuboid, 1.4);  // the same as -0.17 with x and y swapped
  const PrimitiveFit fit = FitPrimitive(SeenPoints(truth, {3.0, -3.0, 2.0}, 300, 0.001), SolidKind::kCuboid);
  EXPECT_NEAR(YawOf(fit.solid), 1.4 - 1.5708, 0.02);
  EXPECT_NEAR(fit.solid.half_size.x(), 0.15, 0.02);
  EXPECT_NEAR(fit.solid.half_size.y(), 0.3, 0.02);
}

TEST(PrimitiveFit, FitsRoundCylindersByDefault) {
  Solid truth = Truth(SolidKind::kCylinder, 0.3);
  const auto half_seen = SeenPoints(truth, {2.0, -4.0, 1.2}, 200, 0.001);
  const PrimitiveFit round = FitPrimitive(half_seen, SolidKind::kCylinder);
  EXPECT_EQ(round.solid.half_size.x(), round.solid.half_size.y());
  EXPECT_NEAR(round.solid.half_size.x(), 0.15, 0.015);
  truth.half_size.x() = 0.3;
  auto points = SeenPoints(truth, {2.0, -4.0, 1.2}, 200, 0.001);
  const auto more = SeenPoints(truth, {4.0, 1.0, 1.2}, 200, 0.001);
  points.insert(points.end(), more.begin(), more.end());
  const PrimitiveFit oval = FitPrimitive(points, SolidKind::kCylinder, {.round = false, .ground = {}});
  EXPECT_NEAR(oval.solid.half_size.x(), 0.3, 0.02);
  EXPECT_NEAR(oval.solid.half_size.y(), 0.15, 0.02);
}

TEST(PrimitiveFit, FitsThinSolidToCoplanarPoints) {
  std::vector<Vector3d> points;
  for (int i = 0; i < 100; ++i) {
    points.push_back({0.01 * (i % 10), 0.02 * (i / 10), 1.0});
  }
  const PrimitiveFit fit = FitPrimitive(points, SolidKind::kCuboid);
  EXPECT_GT(fit.solid.half_size.minCoeff(), 0.0);
  EXPECT_LT(fit.solid.half_size.z(), 0.01);
}

TEST(PrimitiveFit, RejectsTooFewPoints) {
  const std::vector<Vector3d> five(5, Vector3d(1.0, 2.0, 3.0));
  EXPECT_EQ(InputErrorOf([&] { FitPrimitive(five, SolidKind::kCuboid); }),
            "5 points, expected 6 or more for a cuboid");
  const std::vector<Vector3d> ten(10, Vector3d(1.0, 2.0, 3.0));
  EXPECT_NE(InputErrorOf([&] { FitPrimitive(ten, SolidKind::kSuperquadric); }), "(no InputError)");
  EXPECT_NE(InputErrorOf([&] { FitPrimitive(ten, SolidKind::kCuboid); }), "(no InputError)") << "one place";
}

}  // namespace
}  // namespace sqslam::viewer
