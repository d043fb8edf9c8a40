#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "slam/features/corners.h"

namespace sqslam {
namespace {

std::vector<cv::KeyPoint> RandomCorners(int count, const cv::Rect& area) {
  cv::RNG random(3);
  std::vector<cv::KeyPoint> corners;
  for (int i = 0; i < count; ++i) {
    const cv::Point2f place(static_cast<float>(random.uniform(area.x, area.x + area.width)),
                            static_cast<float>(random.uniform(area.y, area.y + area.height)));
    corners.emplace_back(place, 1.0F, -1.0F, static_cast<float>(i));
  }
  return corners;
}

TEST(DistributeByQuadtree, KeepsAllOfFewCorners) {
  const std::vector<cv::KeyPoint> corners = RandomCorners(20, {0, 0, 100, 50});
  EXPECT_EQ(DistributeByQuadtree(corners, {100, 50}, 20).size(), 20U);
}

TEST(DistributeByQuadtree, ThinsDenseCornersAndKeepsIsolatedOnes) {
  std::vector<cv::KeyPoint> corners = RandomCorners(500, {0, 0, 60, 60});
  corners.emplace_back(cv::Point2f(500.0F, 200.0F), 1.0F, -1.0F, 0.5F);  // weaker than almost all
  const std::vector<cv::KeyPoint> kept = DistributeByQuadtree(corners, {600, 240}, 50);
  EXPECT_GE(kept.size(), 50U);
  EXPECT_LE(kept.size(), 53U);  // the last split may add three
  const auto is_lonely = [](const cv::KeyPoint& corner) { return corner.pt.x == 500.0F; };
  EXPECT_EQ(std::count_if(kept.begin(), kept.end(), is_lonely), 1);
}

TEST(DistributeByQuadtree, KeepsStrongestCornerOfOnePlace) {
  std::vector<cv::KeyPoint> corners(10, cv::KeyPoint(10.0F, 10.0F, 1.0F));
  corners[4].response = 9.0F;
  const std::vector<cv::KeyPoint> kept = DistributeByQuadtree(corners, {64, 64}, 5);
  ASSERT_EQ(kept.size(), 1U);
  EXPECT_EQ(kept[0].response, 9.0F);
}

}  // namespace
}  // namespace sqslam
