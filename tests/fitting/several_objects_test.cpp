#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "slam/fitting/fitting.h"
#include "slam/geometry/solid_iou.h"
#include "slam/util/error.h"
#include "tests/fitting/synthetic_cloud.h"

namespace sqslam {
namespace {

using Eigen::Vector3d;
using ::testing::SizeIs;

// Three objects on a table, the largest with the most points.
struct Table {
  std::vector<PosedSuperquadric> objects;
  std::vector<Vector3d> cloud;
};

Table MakeTable(std::mt19937_64& random) {
  Table table;
  const auto add = [&](const Superquadric& shape, double x, double y, int points) {
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(x, Vector3d::UnitZ()));
    table.objects.push_back({shape, {turn, {x, y, shape.half_size.z()}}});
    const auto part = testing::SampleCloud(table.objects.back(), {points, 0.0, 0.005, false}, random);
    table.cloud.insert(table.cloud.end(), part.begin(), part.end());
  };
  add({{0.3, 0.2, 0.15}, 0.1, 0.1}, -1.0, 0.2, 1500);
  add({{0.15, 0.15, 0.2}, 0.1, 1.0}, 0.3, -0.6, 1000);
  add({{0.15, 0.15, 0.15}, 1.0, 1.0}, 0.9, 0.7, 700);
  std::uniform_real_distribution<double> along(-1.8, 1.8);
  std::normal_distribution<double> noise(0.0, 0.003);
  for (int i = 0; i < 6000; ++i) {
    table.cloud.emplace_back(along(random), along(random), noise(random));
  }
  std::shuffle(table.cloud.begin(), table.cloud.end(), random);
  return table;
}

TEST(FitSuperquadrics, FindsObjectsOnTable) {
  std::mt19937_64 random(1);
  const Table table = MakeTable(random);
  MultiFitOptions options;
  options.remove_plane = true;
  options.clusters = 0;
  for (const bool upright : {false, true}) {
    options.fit.upright = upright;
    const std::vector<SuperquadricFit> fits = FitSuperquadrics(table.cloud, options);
    ASSERT_THAT(fits, SizeIs(3));
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_GT(IoU(Solid::FromSuperquadric(fits[i].superquadric), Solid::FromSuperquadric(table.objects[i])),
                0.85)
          << i << (upright ? " upright" : "");
      EXPECT_THAT(fits[i].inlier, SizeIs(table.cloud.size()));
    }
  }
  options.clusters = 2;
  EXPECT_THAT(FitSuperquadrics(table.cloud, options), SizeIs(2));
  options.clusters = 0;
  options.min_cluster_points = 9000;
  EXPECT_THROW(FitSuperquadrics(table.cloud, options), InputError);
}

TEST(FindLargestPlane, FindsTiltedPlaneInClutter) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> along(-1.0, 1.0);
  const Vector3d normal = Vector3d(0.3, -0.5, 1.0).normalized();
  std::vector<Vector3d> points;
  for (int i = 0; i < 1000; ++i) {
    Vector3d p(along(random), along(random), along(random));
    if (i % 3 == 0) {
      p += (0.4 - normal.dot(p)) * normal;
    }
    points.push_back(p);
  }
  const auto plane = FindLargestPlane(points, 0.01, false, 0);
  ASSERT_TRUE(plane);
  EXPECT_GT(std::abs(plane->normal.dot(normal)), 0.9999);
  EXPECT_NEAR(std::abs(plane->offset), 0.4, 2e-3);
  const auto level = FindLargestPlane(points, 0.01, true, 0);
  EXPECT_TRUE(!level || std::abs(level->normal.z()) > 0.95);
  EXPECT_FALSE(FindLargestPlane(std::vector<Vector3d>(100, Vector3d::Ones()), 0.01, false, 0));
}

TEST(ClusterPoints, SplitsAtGapsAndDropsOutliers) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> spread(0.0, 0.1);
  std::vector<Vector3d> points = {{5.0, 5.0, 5.0}};
  for (int i = 0; i < 300; ++i) {
    points.emplace_back(spread(random) + (i % 3 == 0 ? 2.0 : 0.0), spread(random), spread(random));
  }
  std::vector<std::size_t> all(points.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  const auto clusters = ClusterPoints(points, all, 3.0);
  ASSERT_THAT(clusters, SizeIs(2));
  EXPECT_GT(clusters[0].size(), 190u);
  EXPECT_GT(clusters[1].size(), 90u);
  for (const std::size_t i : clusters[0]) {
    EXPECT_LT(points[i].x(), 1.0);
    EXPECT_NE(i, 0u);
  }
  EXPECT_TRUE(ClusterPoints(points, {}, 3.0).empty());
}

}  // namespace
}  // namespace sqslam
