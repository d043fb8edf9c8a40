#include "slam/dense/plane_fill.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

namespace sqslam {
namespace {

// A slanted wall with a plain door in it, of which only a rim has a depth, and a noisy pattern about it.
DepthMap WallWithDoor(double aside = 0.0) {
  DepthMap map;
  map.camera = {160, 120, 150.0, 150.0, 80.0, 60.0, {}, 30.0};
  map.T_map_camera.translation.x() = aside;
  map.depth.create(120, 160, CV_32F);
  map.views = cv::Mat(120, 160, CV_8U, cv::Scalar(4));
  map.bgr.create(120, 160, CV_8UC3);
  cv::RNG random(3);
  random.fill(map.bgr, cv::RNG::UNIFORM, 0, 255);
  for (int y = 0; y < 120; ++y) {
    for (int x = 0; x < 160; ++x) {  // z = 2 + 0.3 x of the map's frame
      const Eigen::Vector3d ray = map.camera.Unproject({double(x), double(y)});
      map.depth.at<float>(y, x) = static_cast<float>((2.0 + 0.3 * aside) / (1.0 - 0.3 * ray.x()));
    }
  }
  const int left = 50 - static_cast<int>(std::lround(aside * 75.0));
  map.bgr(cv::Rect(left, 30, 60, 60)).setTo(cv::Scalar(20, 20, 160));
  map.depth(cv::Rect(left + 5, 35, 50, 50)).setTo(0.0F);
  map.views(cv::Rect(left + 5, 35, 50, 50)).setTo(0);
  return map;
}

constexpr double kTrue = 2.0 / (1.0 - 0.3 * (80.0 - 80.0) / 150.0);

TEST(PlaneFill, FillsPlainRegionWithSurroundingPlane) {
  const DepthMap filled = FillPlanes(WallWithDoor());
  EXPECT_EQ(filled.views.at<std::uint8_t>(60, 80), kFilledByPlane);
  EXPECT_NEAR(filled.depth.at<float>(60, 80), kTrue, 0.005);
  EXPECT_GT(cv::countNonZero(filled.views == kFilledByPlane), 2000);
  EXPECT_EQ(filled.views.at<std::uint8_t>(10, 10), 4);  // what was measured stays
}

TEST(PlaneFill, FillsNothingWhenBorderLiesOnNoPlane) {
  DepthMap map = WallWithDoor();
  cv::RNG random(5);
  for (int y = 25; y < 95; ++y) {
    for (int x = 45; x < 115; ++x) {
      map.depth.at<float>(y, x) *= static_cast<float>(random.uniform(0.8, 1.2));
    }
  }
  EXPECT_EQ(cv::countNonZero(FillPlanes(map).views == kFilledByPlane), 0);
}

TEST(PlaneFill, FillsNothingBeyondKnownDepth) {
  DepthMap map = WallWithDoor();
  map.depth.colRange(78, 160).setTo(0.0F);  // of the door only the left rim is known
  const DepthMap filled = FillPlanes(map);
  EXPECT_EQ(cv::countNonZero(filled.views.colRange(100, 160) == kFilledByPlane), 0);
}

// Plain doors that go round a corner of the room: z = 2 + x on the left of it, z = 2 - x on the right.
DepthMap DoorsAtACorner() {
  DepthMap map = WallWithDoor();
  map.bgr(cv::Rect(20, 30, 120, 60)).setTo(cv::Scalar(20, 20, 160));
  for (int y = 0; y < 120; ++y) {
    for (int x = 0; x < 160; ++x) {
      const double ray = std::abs(map.camera.Unproject({double(x), double(y)}).x());
      map.depth.at<float>(y, x) = static_cast<float>(2.0 / (1.0 + ray));
    }
  }
  map.depth(cv::Rect(25, 35, 110, 50)).setTo(0.0F);
  map.views.setTo(4);
  map.views(cv::Rect(25, 35, 110, 50)).setTo(0);
  return map;
}

TEST(PlaneFill, FillsRegionAroundCornerWithPlaneOnEachSide) {
  const DepthMap filled = FillPlanes(DoorsAtACorner());
  for (const int x : {45, 115}) {
    EXPECT_EQ(filled.views.at<std::uint8_t>(60, x), kFilledByPlane);
    EXPECT_NEAR(filled.depth.at<float>(60, x), 2.0 / (1.0 + 35.0 / 150.0), 0.005);
  }
  for (int y = 35; y < 85; ++y) {
    for (int x = 25; x < 135; ++x) {
      if (const float z = filled.depth.at<float>(y, x); z > 0.0F) {
        EXPECT_NEAR(z, 2.0 / (1.0 + std::abs(x - 80.0) / 150.0), 0.1);
      }
    }
  }
  EXPECT_GT(cv::countNonZero(filled.views == kFilledByPlane), 2500);
}

// The few depths on a plain door are of its edges and handles, and are noisy.
TEST(PlaneFill, FillsDoorsAtCornerDespiteNoise) {
  DepthMap map = DoorsAtACorner();
  cv::RNG random(7);
  for (auto z = map.depth.begin<float>(); z != map.depth.end<float>(); ++z) {
    *z *= static_cast<float>(1.0 + random.gaussian(0.012));
  }
  const DepthMap filled = FillPlanes(map);
  EXPECT_GT(cv::countNonZero(filled.views == kFilledByPlane), 5000);
  for (const int x : {45, 115}) {
    EXPECT_NEAR(filled.depth.at<float>(60, x), 2.0 / (1.0 + 35.0 / 150.0), 0.03);
  }
}

TEST(PlaneFill, KeepsFillsThatNeighboursConfirm) {
  constexpr int kMinViews = 2;
  const DepthMap own = FillPlanes(WallWithDoor());
  const std::vector<DepthMap> same = {FillPlanes(WallWithDoor(0.1)), FillPlanes(WallWithDoor(-0.1))};
  EXPECT_EQ(KeepConfirmedFills(own, same, {kMinViews}).views.at<std::uint8_t>(60, 80), kFilledByPlane);
  EXPECT_EQ(KeepConfirmedFills(own, {same[0]}, {kMinViews}).views.at<std::uint8_t>(60, 80), 0);

  std::vector<DepthMap> behind = same;
  behind.push_back(WallWithDoor(0.05));
  behind.back().depth.setTo(3.0F);  // a room seen through the door
  const DepthMap open = KeepConfirmedFills(own, behind, {kMinViews});
  EXPECT_EQ(open.views.at<std::uint8_t>(60, 80), 0);
  EXPECT_EQ(open.depth.at<float>(60, 80), 0.0F);
  EXPECT_EQ(open.views.at<std::uint8_t>(10, 10), 4);
}

TEST(PlaneFill, RepeatsWithoutChange) {
  const DepthMap once = FillPlanes(WallWithDoor());
  const DepthMap twice = FillPlanes(once);
  EXPECT_EQ(cv::norm(once.depth, twice.depth, cv::NORM_INF), 0.0);
}

}  // namespace
}  // namespace sqslam
