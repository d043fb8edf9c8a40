#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "slam/features/corners.h"

namespace sqslam {
namespace {

constexpr int kSize = 40;
const cv::Point kMiddle(20, 20);

// A bright quadrant whose corner lies at `corner`, blurred by a lens; drawn eight times too large and
// averaged.
cv::Mat Quadrant(const cv::Point2d& corner) {
  constexpr int kFiner = 8;
  cv::Mat fine(kSize * kFiner, kSize * kFiner, CV_8UC1, cv::Scalar(60));
  const cv::Point begin(cvRound((corner.x + 0.5) * kFiner), cvRound((corner.y + 0.5) * kFiner));
  cv::rectangle(fine, begin, {fine.cols - 1, fine.rows - 1}, cv::Scalar(180), cv::FILLED);
  cv::GaussianBlur(fine, fine, {}, kFiner);
  cv::Mat image;
  cv::resize(fine, image, {kSize, kSize}, 0, 0, cv::INTER_AREA);
  return image;
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
