#include "slam/objects/object_solid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "slam/objects/object_class.h"

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

TEST(ObjectSolid, EqualsTheSuperquadricWithoutTaperOrParts) {
  const PosedSuperquadric s = MakeSuperquadric({0.3, 0.2, 0.4}, 0.7, 0.4);
  const SolidParameters x = PackSolid(s);
  const ObjectSolid<double> solid(x.data(), {});
  for (const Eigen::Vector3d& n : kDirections) {
    EXPECT_NEAR(solid.Support(n), SupportExtent(s, n), 1e-9);
    EXPECT_NEAR(solid.RadialDistance(n), s.shape.RadialDistance(s.T_map_object.Inverse() * n), 1e-9);
  }
}

TEST(ObjectSolid, EqualsTiltedEllipsoidWhenLeaning) {
  PosedSuperquadric s = MakeSuperquadric({0.3, 0.2, 0.4}, 1.0, 1.0);
  const Eigen::Vector3d tilt(0.5, -0.3, 0.0);
  AllParameters x = AllParameters::Zero();
  x.head<parameter::kCount>() = PackSolid(s);
  x.segment<3>(parameter::kTilt) = tilt;
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
  const auto distance_at = [&](double width, double z) {
    return solid.RadialDistance(s.T_map_object * Eigen::Vector3d(0.3 * width, 0.0, z));
  };
  EXPECT_NEAR(distance_at(1.0, 0.0), 0.0, 1e-9);
  EXPECT_NEAR(distance_at(0.75, -0.2), 0.0, 1e-6);
  EXPECT_NEAR(distance_at(0.9, 0.2), 0.0, 1e-6);
  EXPECT_LT(distance_at(0.4, -0.399), 0.0);
  EXPECT_GT(distance_at(0.5, -0.6), 0.15);
}

PartTemplate ChairTemplate() { return ClassTable::Named("default").Of("chair").parts.front(); }

// Deviations of the proportions from their means.
AllParameters WithProportions(const PosedSuperquadric& hull) {
  AllParameters x = AllParameters::Zero();
  x.head<parameter::kCount>() = PackSolid(hull);
  x.segment<4>(parameter::kProportions) << 0.02, -0.03, 0.04, 0.01;
  return x;
}

std::vector<PosedSuperquadric> PlacedParts(const PosedSuperquadric& hull, const PartTemplate& of,
                                           const AllParameters& x) {
  Proportions proportions{};
  for (std::size_t k = 0; k < of.free.size(); ++k) {
    proportions[k] = of.free[k].mean + x[parameter::kProportions + static_cast<int>(k)];
  }
  std::vector<PosedSuperquadric> placed;
  for (SolidPart part : PartsWith(of, proportions, hull.shape.half_size, 0)) {
    part.shape.e1 = hull.shape.e1, part.shape.e2 = hull.shape.e2;
    placed.push_back(PlacedIn(hull, part));
  }
  return placed;
}

TEST(ObjectSolid, SupportEqualsTheFarthestOfItsParts) {
  const PosedSuperquadric hull = MakeSuperquadric({0.25, 0.2, 0.45}, 0.1, 0.1);
  const PartTemplate chair = ChairTemplate();
  const AllParameters x = WithProportions(hull);
  const ObjectSolid<double> solid(x.data(), {.parts = &chair});
  for (const Eigen::Vector3d& n : kDirections) {
    double farthest = -1.0;
    for (const PosedSuperquadric& part : PlacedParts(hull, chair, x)) {
      farthest = std::max(farthest, n.dot(part.T_map_object.translation - hull.T_map_object.translation) +
                                        SupportExtent(part, n));
    }
    EXPECT_NEAR(solid.Support(n), farthest, 1e-3 * farthest);
  }
  const Eigen::Vector3d forward_and_up(1.0, 0.0, 1.0);  // over the seat, where the hull holds air
  EXPECT_LT(solid.Support(hull.T_map_object.rotation * forward_and_up),
            0.9 * hull.shape.SupportExtent(forward_and_up));
}

TEST(ObjectSolid, MeasuresDistanceToTheNearestPart) {
  const PosedSuperquadric hull = MakeSuperquadric({0.25, 0.2, 0.45}, 0.1, 0.1);
  const PartTemplate chair = ChairTemplate();
  const AllParameters x = WithProportions(hull);
  const ObjectSolid<double> solid(x.data(), {.parts = &chair});
  for (const PosedSuperquadric& part : PlacedParts(hull, chair, x)) {
    const Eigen::Vector3d end = part.T_map_object * Eigen::Vector3d(0.0, 0.0, part.shape.half_size.z());
    const Eigen::Vector3d front = part.T_map_object * Eigen::Vector3d(part.shape.half_size.x(), 0.0, 0.0);
    EXPECT_LT(std::min(std::abs(solid.RadialDistance(end)), std::abs(solid.RadialDistance(front))), 1e-9);
  }
  EXPECT_GT(solid.RadialDistance(hull.T_map_object * Eigen::Vector3d(0.2, 0.0, 0.4)), 0.1) << "over the seat";
  EXPECT_TRUE(solid.IsInHull(hull.T_map_object * Eigen::Vector3d(0.2, 0.0, 0.4)));
}

TEST(ObjectSolid, UnpacksItsParts) {
  const PosedSuperquadric hull = MakeSuperquadric({0.25, 0.2, 0.45}, 0.1, 0.1);
  const PartTemplate chair = ChairTemplate();
  const AllParameters x = WithProportions(hull);
  const std::vector<SolidPart> parts = UnpackParts(x, {.parts = &chair});
  const std::vector<PosedSuperquadric> expected = PlacedParts(hull, chair, x);
  ASSERT_EQ(parts.size(), expected.size());
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const PosedSuperquadric placed = PlacedIn(hull, parts[i]);
    EXPECT_LT((placed.T_map_object.translation - expected[i].T_map_object.translation).norm(), 1e-9);
    EXPECT_LT((placed.shape.half_size - expected[i].shape.half_size).norm(), 1e-9);
  }
}

}  // namespace
}  // namespace sqslam
