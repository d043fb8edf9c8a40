#include "slam/objects/object_solid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace sqslam {
namespace {

const Eigen::Vector3d kDirections[] = {{1, 2, 3}, {-2, 1, -0.1}, {0, 1, 0}, {-1.0, 0.3, -0.8}, {1, 0, 0}};

PosedSuperquadric MakeSuperquadric(const Eigen::Vector3d& half_size, double e1, double e2) {
  PosedSuperquadric s;
  s.shape = {half_size, e1, e2};
  s.T_map_object = {Eigen::Quaterniond(Eigen::AngleAxisd(0.6, Eigen::Vector3d::UnitZ())), {0.05, -0.04, 0.1}};
  return s;
}

SolidParameters WithTapers(const PosedSuperquadric& s, double lower, double upper) {
  SolidParameters x = PackSolid(s);
  x.segment<2>(parameter::kTaper) << std::log(lower), std::log(upper);
  return x;
}

TEST(ObjectSolid, UnpacksToThePackedSuperquadric) {
  const PosedSuperquadric s = MakeSuperquadric({0.3, 0.2, 0.4}, 0.4, 1.3);
  const PosedSuperquadric same = UnpackSolid(PackSolid(s));
  EXPECT_LT((same.shape.half_size - s.shape.half_size).norm(), 1e-12);
  EXPECT_NEAR(same.shape.e1, s.shape.e1, 1e-12);
  EXPECT_NEAR(same.shape.e2, s.shape.e2, 1e-12);
  EXPECT_LT((same.T_map_object.translation - s.T_map_object.translation).norm(), 1e-12);
  EXPECT_LT(same.T_map_object.rotation.angularDistance(s.T_map_object.rotation), 1e-12);
}

TEST(ObjectSolid, EqualsTheSuperquadricWithoutTaperOrHandle) {
  const PosedSuperquadric s = MakeSuperquadric({0.3, 0.2, 0.4}, 0.7, 0.4);
  const SolidParameters x = PackSolid(s);
  const ObjectSolid<double> solid(x.data(), {});
  for (const Eigen::Vector3d& n : kDirections) {
    EXPECT_NEAR(solid.Support(n), SupportExtent(s, n), 1e-9);
    EXPECT_NEAR(solid.RadialDistance(solid.ToBody(n)), s.shape.RadialDistance(s.T_map_object.Inverse() * n),
                1e-9);
  }
}

TEST(ObjectSolid, EqualsTiltedEllipsoidWhenLeaning) {
  PosedSuperquadric s = MakeSuperquadric({0.3, 0.2, 0.4}, 1.0, 1.0);
  const Eigen::Vector3d tilt(0.5, -0.3, 0.0);
  Eigen::Matrix<double, parameter::kMostCount, 1> x;
  x << PackSolid(s), tilt;
  x.segment<2>(parameter::kExponents).setConstant(0.7);  // is ignored
  s.T_map_object.rotation =
      s.T_map_object.rotation * Eigen::Quaterniond(Eigen::AngleAxisd(tilt.norm(), tilt.normalized()));
  const ObjectSolid<double> solid(x.data(), {.leaning = true});
  for (const Eigen::Vector3d& n : kDirections) {
    EXPECT_NEAR(solid.Support(n), SupportExtent(s, n), 1e-9);
  }
}

TEST(ObjectSolid, SupportEqualsTheFarthestPointWhenTapered) {
  const PosedSuperquadric s = MakeSuperquadric({0.3, 0.3, 0.4}, 0.1, 1.0);
  for (const double taper : {0.3, 0.6, 1.0}) {
    const SolidParameters x = WithTapers(s, taper, taper);
    const ObjectSolid<double> solid(x.data(), {.tapered = true});
    const auto farthest = [&](const Eigen::Vector3d& n) {
      double reach = 0.0;
      for (int i = 0; i <= 40; ++i) {
        for (int k = 0; k < 60; ++k) {
          Eigen::Vector3d p = s.shape.PointAt(-M_PI / 2 + M_PI * i / 40, 2.0 * M_PI * k / 60);
          if (p.z() * n.z() > 0.0) {
            p.head<2>() *= 1.0 - (1.0 - taper) * std::abs(p.z()) / s.shape.half_size.z();
          }
          reach = std::max(reach, n.dot(s.T_map_object.rotation * p));
        }
      }
      return reach;
    };
    for (const double up : {-3.0, -1.0, -0.2, 0.0, 0.5, 2.0}) {
      const Eigen::Vector3d n = Eigen::Vector3d(0.8, 0.6, up).normalized();
      EXPECT_NEAR(solid.Support(n), farthest(n), 0.03 * solid.Support(n)) << taper << " " << up;
    }
  }
}

TEST(ObjectSolid, WidthFallsToTheTaperAtTheEndAndStaysBeyond) {
  const PosedSuperquadric s = MakeSuperquadric({0.3, 0.3, 0.4}, 0.1, 1.0);
  const SolidParameters x = WithTapers(s, 0.5, 0.8);
  const ObjectSolid<double> solid(x.data(), {.tapered = true});
  const auto width = [&](double z) {
    const Eigen::Vector3d p_map = s.T_map_object * Eigen::Vector3d(0.1, 0.0, z);
    return 0.1 / solid.ToBody(p_map).x();
  };
  EXPECT_NEAR(width(0.0), 1.0, 1e-12);
  EXPECT_NEAR(width(-0.2), 0.75, 1e-12);
  EXPECT_NEAR(width(-0.4), 0.5, 1e-12);
  EXPECT_NEAR(width(-0.6), 0.5, 1e-12);
  EXPECT_NEAR(width(0.2), 0.9, 1e-12);
}

TEST(ObjectSolid, BodyFillsTheHullExceptTheEndWithTheHandle) {
  const PosedSuperquadric s = MakeSuperquadric({0.6, 0.4, 0.5}, 0.15, 1.0);
  const SolidParameters x = PackSolid(s);
  const ObjectSolid<double> solid(x.data(), {.handled = true});
  const auto distance = [&](const Eigen::Vector3d& p) {
    return solid.RadialDistance(solid.ToBody(s.T_map_object * p));
  };
  EXPECT_NEAR(distance({-0.6, 0.0, 0.0}), 0.0, 1e-9);
  EXPECT_NEAR(distance({0.2, 0.0, 0.0}), 0.0, 1e-9);  // twice 0.4 from the other end
  EXPECT_NEAR(distance({0.6, 0.0, 0.0}), 0.4, 1e-9);
  EXPECT_NEAR(distance({-0.2, 0.4, 0.0}), 0.0, 1e-9);
}

TEST(ObjectSolid, SupportEqualsTheFarthestPointOfBodyAndHandle) {
  const Eigen::Vector3d hull(0.6, 0.4, 0.5);
  const PosedSuperquadric s = MakeSuperquadric(hull, 0.15, 1.0);
  const SolidParameters x = PackSolid(s);
  const ObjectSolid<double> solid(x.data(), {.handled = true});
  const Superquadric body{{hull.y(), hull.y(), hull.z()}, 0.15, 1.0};
  for (const Eigen::Vector3d& n : kDirections) {
    const double handle = hull.x() * n.x() + 0.5 * hull.z() * std::abs(n.z());
    const double expected = std::max(handle, body.SupportExtent(n) + (hull.y() - hull.x()) * n.x());
    EXPECT_NEAR(solid.Support(s.T_map_object.rotation * n), expected, 1e-9);
  }
}

}  // namespace
}  // namespace sqslam
