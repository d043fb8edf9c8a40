#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "slam/features/corners.h"

namespace sqslam {
namespace {

constexpr int kSize = 40;
const cv::Point kMiddle(20, 20);

// Something bright within a polygon, blurred by a lens; drawn eight times too large and averaged.
cv::Mat Bright(const std::vector<cv::Point2d>& polygon) {
  constexpr int kFiner = 8;
  cv::Mat fine(kSize * kFiner, kSize * kFiner, CV_8UC1, cv::Scalar(60));
  std::vector<cv::Point> corners;
  for (const cv::Point2d& corner : polygon) {
    corners.emplace_back((corner + cv::Point2d(0.5, 0.5)) * kFiner);
  }
  cv::fillConvexPoly(fine, corners, cv::Scalar(180));
  cv::GaussianBlur(fine, fine, {}, kFiner);
  cv::Mat image;
  cv::resize(fine, image, {kSize, kSize}, 0, 0, cv::INTER_AREA);
  return image;
}

cv::Mat Quadrant(const cv::Point2d& corner) {
  return Bright({corner, {2.0 * kSize, corner.y}, {2.0 * kSize, 2.0 * kSize}, {corner.x, 2.0 * kSize}});
}

TEST(IsOnEdge, TellsEdgesOfAnyDirectionFromCorners) {
  EXPECT_FALSE(IsOnEdge(Quadrant({19.0, 19.0}), kMiddle));
  for (double angle = 0.0; angle < 3.14; angle += 0.2) {
    constexpr double kLength = 100.0;
    const cv::Point2d along(kLength * std::cos(angle), kLength * std::sin(angle));
    const cv::Point2d across(-along.y, along.x);
    const cv::Point2d middle(kMiddle);
    EXPECT_TRUE(IsOnEdge(
        Bright({middle - along, middle + along, middle + along + across, middle - along + across}), kMiddle))
        << angle;
  }
}

TEST(RefineCorner, FollowsCornerBetweenPixels) {
  const cv::Point2f before = RefineCorner(Quadrant({19.0, 19.0}), kMiddle);
  for (const cv::Point2d shift : {cv::Point2d(0.25, 0.0), cv::Point2d(0.0, -0.25), cv::Point2d(0.375, 0.25),
                                  cv::Point2d(-0.375, -0.375)}) {
    const cv::Point2f after = RefineCorner(Quadrant(cv::Point2d(19.0, 19.0) + shift), kMiddle);
    EXPECT_NEAR(after.x - before.x, shift.x, 0.15);
    EXPECT_NEAR(after.y - before.y, shift.y, 0.15);
  }
}

TEST(RefineCorner, KeepsSymmetricCorner) {
  cv::Mat image(kSize, kSize, CV_8UC1, cv::Scalar(50));
  image.at<std::uint8_t>(kMiddle) = 250;
  const cv::Point2f offset = RefineCorner(image, kMiddle);
  EXPECT_FLOAT_EQ(offset.x, 0.0F);
  EXPECT_FLOAT_EQ(offset.y, 0.0F);
}

TEST(RefineCorner, KeepsPixelWithoutMaximum) {
  const cv::Mat flat(kSize, kSize, CV_8UC1, cv::Scalar(128));
  EXPECT_EQ(RefineCorner(flat, kMiddle), cv::Point2f());
}

TEST(RefineCorner, LimitsOffset) {
  cv::Mat noise(kSize, kSize, CV_8UC1);
  cv::RNG random(1);
  random.fill(noise, cv::RNG::UNIFORM, 0, 256);
  for (int y = 5; y < kSize - 5; ++y) {
    for (int x = 5; x < kSize - 5; ++x) {
      const cv::Point2f offset = RefineCorner(noise, {x, y});
      EXPECT_LE(std::abs(offset.x), kMaxCornerOffset);
      EXPECT_LE(std::abs(offset.y), kMaxCornerOffset);
    }
  }
}

}  // namespace
}  // namespace sqslam
