#include "render/scene/cloud_layer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "render/scene/cloud_view.h"

namespace sqslam {
namespace {

// Points `step` apart on a square of side 1.
CloudLayerPtr Plane(double step, double spacing, std::size_t most = 1'000'000) {
  CloudLayerBuilder builder(spacing, most);
  const int count = static_cast<int>(1.0 / step);
  for (int y = 0; y < count; ++y) {
    for (int x = 0; x < count; ++x) {
      builder.Add(Eigen::Vector3f(static_cast<float>(step * x), static_cast<float>(step * y), 0.1F),
                  {200, static_cast<std::uint8_t>(x % 2 == 0 ? 100 : 110), 50}, static_cast<float>(step),
                  1.0F, y);
    }
  }
  return builder.Finish();
}

TEST(CloudLayerTest, MergesPointsOfOneCubeAtTheirMean) {
  CloudLayerBuilder builder(1.0);
  builder.Add({0.2F, 0.5F, 0.5F}, {10, 20, 30}, 0.1F, 1.0F, 3);
  builder.Add({0.6F, 0.5F, 0.5F}, {30, 20, 10}, 0.1F, 3.0F, 8);
  builder.Add({1.2F, 0.5F, 0.5F}, {0, 0, 0}, 2.0F, 1.0F, 9);
  const CloudLayerPtr cloud = builder.Finish();
  ASSERT_EQ(cloud->points.size(), 2U);
  EXPECT_LT((cloud->points[0].p_map - Eigen::Vector3f(0.5F, 0.5F, 0.5F)).norm(), 1e-6F);
  EXPECT_EQ(cloud->points[0].rgb, (std::array<std::uint8_t, 3>{25, 20, 15}));
  EXPECT_EQ(cloud->points[0].frame, 3) << "there from the first of them on";
  EXPECT_EQ(cloud->points[0].spacing, 1.0F);
  EXPECT_EQ(cloud->points[1].spacing, 2.0F) << "as far apart as in their depth map";
}

TEST(CloudLayerTest, HalvesPointsWithEachLevel) {
  const CloudLayerPtr cloud = Plane(0.005, 0.005);
  std::vector<double> counts;
  for (int rank = 0; rank < CloudLayer::kRanks; ++rank) {
    counts.push_back(static_cast<double>(std::count_if(
        cloud->points.begin(), cloud->points.end(), [rank](const CloudPoint& p) { return p.rank >= rank; })));
  }
  for (std::size_t rank = 1; rank < 7; ++rank) {
    EXPECT_GT(counts[rank], 0.3 * counts[rank - 1]) << rank;
    EXPECT_LT(counts[rank], 0.8 * counts[rank - 1]) << rank;
  }
}

TEST(CloudLayerTest, KeepsOrderWhenCoarsened) {
  const CloudLayerPtr cloud = Plane(0.005, 0.005, 5000);
  EXPECT_LE(cloud->points.size(), 5000U);
  EXPECT_GT(cloud->points.size(), 1000U);
  EXPECT_NEAR(cloud->spacing, 0.02, 1e-9);
  EXPECT_TRUE(std::ranges::is_sorted(cloud->points, {}, &CloudPoint::frame));
}

TEST(CloudLayerTest, ChoosesLevelWhenCameraIsNotFinite) {
  CloudView view;
  view.Show(Plane(0.05, 0.05));
  for (const double x :
       {1e160, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
    ViewCamera camera;
    camera.position.x() = x;
    view.LookFrom(camera, 240.0, 1.5, 1.0, 100);  // once read the counts of a level far out of their array
  }
}

TEST(CloudLayerTest, EstimatesSpacingOfSurface) {
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 40000; ++i) {  // a sunflower's pattern: each has 0.01 x 0.01
    const double radius = 0.01 * std::sqrt(i / 3.14159);
    points.emplace_back(static_cast<float>(radius * std::cos(2.399963 * i)),
                        static_cast<float>(radius * std::sin(2.399963 * i)), 0.5F);
  }
  EXPECT_NEAR(SpacingOf(points), 0.01, 0.003);
  EXPECT_GT(SpacingOf({Eigen::Vector3f::Zero()}), 0.0);
}

}  // namespace
}  // namespace sqslam
