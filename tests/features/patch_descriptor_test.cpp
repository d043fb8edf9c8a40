#include "slam/features/patch_descriptor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>

#include "tests/support/textured_world.h"

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

TEST(PatchAngle, PointsToTheIntensityCentroid) {
  const cv::Mat image = Noise();
  for (int y = 16; y < image.rows - 16; y += 3) {
    for (int x = 16; x < image.cols - 16; x += 3) {
      EXPECT_EQ(PatchAngle(image, {x, y}), MomentAngle(image, {x, y}));
    }
  }
}

TEST(PatchAngle, MeasuresDegreesFromXTowardsY) {
  cv::Mat image(64, 64, CV_8UC1, cv::Scalar(0));
  image.rowRange(32, 64).setTo(255);
  EXPECT_NEAR(PatchAngle(image, {32, 32}), 90.0F, 0.5F);
}

// The bundled vocabulary was trained on these bits, and matching thresholds are those known for them.
TEST(DescribePatch, MatchesBitsOfOpenCv) {
  const cv::Mat image = testing::TexturedWorld().Render(0, {}).gray;
  std::vector<cv::KeyPoint> keypoints;
  for (int y = 19; y < image.rows - 19; y += 4) {
    for (int x = 19; x < image.cols - 19; x += 4) {
      const cv::Point2f place(static_cast<float>(x), static_cast<float>(y));
      keypoints.emplace_back(place, 31.0F, PatchAngle(image, {x, y}), 0.0F, 0);
    }
  }
  cv::Mat expected;
  cv::ORB::create(10000, 1.2F, 1, 16)->compute(image, keypoints, expected);
  cv::Mat blurred;
  BlurForDescriptors(image, blurred);
  ASSERT_GE(keypoints.size(), 3000U);
  for (std::size_t i = 0; i < keypoints.size(); ++i) {
    const Descriptor descriptor = DescribePatch(blurred, keypoints[i].pt, keypoints[i].angle);
    const cv::Mat ours(1, static_cast<int>(descriptor.size()), CV_8UC1,
                       const_cast<std::uint8_t*>(descriptor.data()));
    EXPECT_EQ(cv::norm(ours, expected.row(static_cast<int>(i)), cv::NORM_HAMMING), 0.0) << keypoints[i].pt;
  }
}

}  // namespace
}  // namespace sqslam
