#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "slam/features/corners.h"

namespace sqslam {
namespace {

cv::Mat Noise() {
  cv::Mat image(96, 120, CV_8UC1);
  cv::RNG(5).fill(image, cv::RNG::UNIFORM, 0, 256);
  return image;
}

// By the definition, pixel by pixel.
float MomentAngle(const cv::Mat& image, const cv::Point& center) {
  int m10 = 0;
  int m01 = 0;
  for (int v = -kPatchRadius; v <= kPatchRadius; ++v) {
    for (int u = -kPatchRadius; u <= kPatchRadius; ++u) {
      if (u * u + v * v <= kPatchRadius * kPatchRadius) {
        m10 += u * image.at<std::uint8_t>(center.y + v, center.x + u);
        m01 += v * image.at<std::uint8_t>(center.y + v, center.x + u);
      }
    }
  }
  return cv::fastAtan2(static_cast<float>(m01), static_cast<float>(m10));
}

TEST(PatchAngle, PointsToIntensityCentroid) {
  const cv::Mat image = Noise();
  for (int y = 16; y < image.rows - 16; y += 3) {
    for (int x = 16; x < image.cols - 16; x += 3) {
      EXPECT_EQ(PatchAngle(image, {x, y}), MomentAngle(image, {x, y}));
    }
  }
}

TEST(PatchAngle, CountsDegreesFromXTowardsY) {
  cv::Mat image(64, 64, CV_8UC1, cv::Scalar(0));
  image.rowRange(32, 64).setTo(255);
  EXPECT_NEAR(PatchAngle(image, {32, 32}), 90.0F, 0.5F);
}

}  // namespace
}  // namespace sqslam
