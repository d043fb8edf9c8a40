#include "slam/fitting/fitting.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "slam/geometry/rigid3.h"
#include "slam/geometry/solid_iou.h"
#include "slam/util/error.h"
#include "tests/fitting/synthetic_cloud.h"

namespace sqslam {
namespace {

using Eigen::Vector3d;
using testing::CloudOptions;
using testing::RandomlyPosed;
using testing::SampleCloud;

double Overlap(const PosedSuperquadric& a, const PosedSuperquadric& b) {
  return IoU(Solid::FromSuperquadric(a), Solid::FromSuperquadric(b));
}

std::vector<Vector3d> Moved(const Sim3d& S, const std::vector<Vector3d>& cloud) {
  std::vector<Vector3d> moved;
  for (const Vector3d& p : cloud) {
    moved.push_back(S * p);
  }
  return moved;
}

TEST(FitSuperquadric, RecoversHalfSeenShapesAmongNoiseAndOutliers) {
  std::mt19937_64 random(5);
  std::vector<double> overlaps;
  for (const double e1 : {0.1, 1.0, 1.9}) {
    for (const double e2 : {0.1, 1.0, 1.9}) {
      const PosedSuperquadric truth = RandomlyPosed(e1, e2, 3.0, random);
      const SuperquadricFit fit = FitSuperquadric(SampleCloud(truth, {}, random), {});
      overlaps.push_back(Overlap(fit.superquadric, truth));
      EXPECT_GT(overlaps.back(), 0.8) << e1 << " " << e2;
      EXPECT_NEAR(fit.inlier_share, 0.9, 0.04);
      EXPECT_NEAR(fit.noise, 0.02 * truth.shape.half_size.mean(), 0.004 * truth.shape.half_size.mean());
    }
  }
  std::nth_element(overlaps.begin(), overlaps.begin() + 4, overlaps.end());
  EXPECT_GT(overlaps[4], 0.95);
}

TEST(FitSuperquadric, FitsCleanSurfaceExactly) {
  std::mt19937_64 random(6);
  for (const auto& [e1, e2] : {std::pair(0.3, 0.3), std::pair(0.3, 1.0), std::pair(1.0, 1.0)}) {
    const PosedSuperquadric truth = RandomlyPosed(e1, e2, 2.0, random);
    const SuperquadricFit fit = FitSuperquadric(SampleCloud(truth, {600, 0.0, 1e-4, false}, random), {});
    EXPECT_GT(Overlap(fit.superquadric, truth), 0.985) << e1 << " " << e2;
    EXPECT_GT(fit.inlier_share, 0.97);
  }
}

TEST(FitSuperquadric, CommutesWithSimilaritiesAndPermutations) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> log_scale(-4.0, 4.0);
  for (int i = 0; i < 6; ++i) {
    const double e1 = std::array{0.1, 0.7, 1.0, 1.6}[i % 4];
    const double e2 = std::array{0.1, 1.0, 1.8}[i % 3];
    const PosedSuperquadric truth = RandomlyPosed(e1, e2, 3.0, random);
    const std::vector<Vector3d> cloud = SampleCloud(truth, {400, 0.1, 0.01, true}, random);
    const double scale = std::exp(log_scale(random));
    const Sim3d S{scale, testing::RandomRotation(random), scale * Vector3d(3.0, -20.0, 7.0)};
    const SuperquadricFit fit = FitSuperquadric(cloud, {});
    std::vector<Vector3d> moved = Moved(S, cloud);
    std::shuffle(moved.begin(), moved.end(), random);
    const SuperquadricFit fit_of_moved = FitSuperquadric(moved, {});
    EXPECT_LT(testing::Difference(fit_of_moved.superquadric, testing::Transformed(S, fit.superquadric)), 1e-6)
        << e1 << " " << e2;
    EXPECT_NEAR(fit_of_moved.rms, scale * fit.rms, 1e-6 * scale * fit.rms);
  }
}

TEST(FitSuperquadric, UprightKeepsVerticalAxis) {
  std::mt19937_64 random(8);
  FitOptions options;
  options.upright = true;
  for (const double e2 : {0.2, 1.0}) {
    PosedSuperquadric truth = RandomlyPosed(0.2, e2, 2.0, random);
    truth.T_map_object.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Vector3d::UnitZ()));
    const SuperquadricFit fit = FitSuperquadric(SampleCloud(truth, {}, random), options);
    EXPECT_LT((fit.superquadric.T_map_object.rotation * Vector3d::UnitZ() - Vector3d::UnitZ()).norm(), 1e-9);
    EXPECT_GT(Overlap(fit.superquadric, truth), 0.9);
  }
}

TEST(FitSuperquadric, MarksOutliersInOrderOfCloud) {
  std::mt19937_64 random(9);
  const PosedSuperquadric truth = RandomlyPosed(0.5, 0.5, 1.5, random);
  std::vector<Vector3d> cloud = SampleCloud(truth, {300, 0.0, 0.005, false}, random);
  for (const std::size_t i : {0UL, 17UL, 299UL}) {
    cloud[i] = truth.T_map_object * (2.5 * (truth.T_map_object.Inverse() * cloud[i]));
  }
  const SuperquadricFit fit = FitSuperquadric(cloud, {});
  ASSERT_EQ(fit.inlier.size(), 300u);
  EXPECT_FALSE(fit.inlier[0] || fit.inlier[17] || fit.inlier[299]);
  EXPECT_GT(std::count(fit.inlier.begin(), fit.inlier.end(), true), 285);
}

TEST(FitSuperquadric, RefusesCloudsWithoutSurface) {
  EXPECT_THROW(FitSuperquadric(std::vector<Vector3d>(10, Vector3d::Ones()), {}), InputError);
  EXPECT_THROW(FitSuperquadric(std::vector<Vector3d>(100, Vector3d::Ones()), {}), InputError);
  std::vector<Vector3d> holes(100, Vector3d::Ones());
  holes[50].x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(FitSuperquadric(holes, {}), InputError);
}

TEST(FitSuperquadric, FitsFiniteShapesToSheetsAndLines) {
  std::mt19937_64 random(10);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::vector<Vector3d> sheet;
  std::vector<Vector3d> line;
  for (int i = 0; i < 200; ++i) {
    sheet.emplace_back(unit(random), unit(random), 0.0);
    line.emplace_back(unit(random), 0.0, 0.0);
  }
  for (const auto& cloud : {sheet, line}) {
    const SuperquadricFit fit = FitSuperquadric(cloud, {});
    EXPECT_TRUE(fit.superquadric.shape.half_size.allFinite());
    EXPECT_TRUE(fit.superquadric.T_map_object.translation.allFinite());
    EXPECT_GT(fit.superquadric.shape.half_size.minCoeff(), 0.0);
  }
}

}  // namespace
}  // namespace sqslam
