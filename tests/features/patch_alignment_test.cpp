#include "slam/features/patch_alignment.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace sqslam {
namespace {

constexpr int kImageSize = 200;
const Eigen::Vector2d kPlace(100.0, 100.0);

cv::Mat NoiseImage(int seed) {
  cv::Mat image(kImageSize, kImageSize, CV_32F);
  cv::RNG random(seed);
  random.fill(image, cv::RNG::UNIFORM, 0.0, 255.0);
  cv::GaussianBlur(image, image, {}, 2.0);
  cv::normalize(image, image, 20.0, 200.0, cv::NORM_MINMAX);
  return image;
}

// The patch whose pixel x shows pixel `at + A * x` of an image.
KeypointPatch PatchOf(const cv::Mat& image, const Eigen::Vector2d& at,
                      const Eigen::Matrix2d& A = Eigen::Matrix2d::Identity()) {
  constexpr int kRadius = KeypointPatch::kRadius;
  const Eigen::Vector2d first = at - A * Eigen::Vector2d(kRadius, kRadius);
  const cv::Mat step = (cv::Mat_<double>(2, 3) << A(0, 0), A(0, 1), first.x(), A(1, 0), A(1, 1), first.y());
  cv::Mat warped;
  cv::warpAffine(image, warped, step, {KeypointPatch::kSide, KeypointPatch::kSide},
                 cv::INTER_CUBIC | cv::WARP_INVERSE_MAP);
  cv::Mat gray;
  warped.convertTo(gray, CV_8U);
  KeypointPatch patch;
  std::copy(gray.begin<std::uint8_t>(), gray.end<std::uint8_t>(), patch.grays.begin());
  return patch;
}

Eigen::Matrix2d Rotation(double angle) { return Eigen::Rotation2Dd(angle).toRotationMatrix(); }

TEST(AlignPatches, FindsShiftToATenthOfAPixel) {
  double squares = 0.0;
  int count = 0;
  for (int seed = 0; seed < 20; ++seed) {
    const cv::Mat image = NoiseImage(seed);
    const Eigen::Vector2d shift(1.2 * std::cos(seed), 1.2 * std::sin(seed));
    const KeypointPatch reference = PatchOf(image, kPlace);
    const KeypointPatch current = PatchOf(image, kPlace - shift);
    const auto found = AlignPatches({&reference}, {&current}, Eigen::Matrix2d::Identity());
    if (found) {
      squares += (*found - shift).squaredNorm();
      ++count;
    }
  }
  EXPECT_GE(count, 15);
  EXPECT_LT(std::sqrt(squares / count), 0.1);
}

TEST(AlignPatches, StartsFromGivenPlaces) {
  const cv::Mat image = NoiseImage(1);
  const Eigen::Vector2d a(0.4, -0.3);
  const KeypointPatch reference = PatchOf(image, kPlace);
  const KeypointPatch current = PatchOf(image, kPlace);
  const auto found = AlignPatches({&reference, a}, {&current, {-0.5, 0.5}}, Eigen::Matrix2d::Identity());
  ASSERT_TRUE(found);
  EXPECT_LT((*found - a).norm(), 0.05);
}

TEST(AlignPatches, FollowsRotationAndScale) {
  const cv::Mat image = NoiseImage(2);
  const KeypointPatch reference = PatchOf(image, kPlace);
  for (const double angle : {-0.5, 0.3, 0.7}) {
    for (const double scale : {0.8, 1.0, 1.2}) {
      const Eigen::Matrix2d A = scale * Rotation(angle);
      const Eigen::Vector2d shift(0.6, -0.7);
      const KeypointPatch current = PatchOf(image, kPlace - A * shift, A);
      const auto found = AlignPatches({&reference}, {&current}, A);
      ASSERT_TRUE(found) << angle << ' ' << scale;
      EXPECT_LT((*found - shift).norm(), 0.1) << angle << ' ' << scale;
    }
  }
}

TEST(AlignPatches, IgnoresGainAndOffsetOfBrightness) {
  const cv::Mat image = NoiseImage(3);
  const KeypointPatch reference = PatchOf(image, kPlace);
  const Eigen::Vector2d shift(0.8, 0.3);
  const KeypointPatch current = PatchOf(0.6 * image + 60.0, kPlace - shift);
  const auto found = AlignPatches({&reference}, {&current}, Eigen::Matrix2d::Identity());
  ASSERT_TRUE(found);
  EXPECT_LT((*found - shift).norm(), 0.05);
}

TEST(AlignPatches, RefusesPatchesWithoutTextureAlongADirection) {
  cv::Mat edge(kImageSize, kImageSize, CV_32F, cv::Scalar(60.0));
  edge.colRange(kImageSize / 2, kImageSize) = 180.0;
  const KeypointPatch along = PatchOf(edge, kPlace);
  EXPECT_FALSE(AlignPatches({&along}, {&along}, Eigen::Matrix2d::Identity()));
  const KeypointPatch flat = PatchOf(cv::Mat(kImageSize, kImageSize, CV_32F, cv::Scalar(60.0)), kPlace);
  EXPECT_FALSE(AlignPatches({&flat}, {&flat}, Eigen::Matrix2d::Identity()));
}

TEST(AlignPatches, RefusesOtherTextureAndFarShifts) {
  int found = 0;
  for (int seed = 0; seed < 20; ++seed) {
    const KeypointPatch reference = PatchOf(NoiseImage(seed), kPlace);
    const KeypointPatch other = PatchOf(NoiseImage(seed + 100), kPlace);
    found += AlignPatches({&reference}, {&other}, Eigen::Matrix2d::Identity()) ? 1 : 0;
    const KeypointPatch far = PatchOf(NoiseImage(seed), kPlace + Eigen::Vector2d(3.5, 0.0));
    const auto shifted = AlignPatches({&reference}, {&far}, Eigen::Matrix2d::Identity());
    found += shifted ? 1 : 0;
  }
  EXPECT_LE(found, 2);
}

TEST(AlignPatches, RefusesWindowsThatLeaveThePatch) {
  const cv::Mat image = NoiseImage(4);
  const KeypointPatch patch = PatchOf(image, kPlace);
  EXPECT_FALSE(AlignPatches({&patch}, {&patch}, 2.0 * Eigen::Matrix2d::Identity()));
  EXPECT_FALSE(AlignPatches({&patch}, {&patch, {5.5, 0.0}}, Eigen::Matrix2d::Identity()));
  EXPECT_FALSE(AlignPatches({&patch, {0.0, -4.5}}, {&patch}, Eigen::Matrix2d::Identity()));
}

}  // namespace
}  // namespace sqslam
