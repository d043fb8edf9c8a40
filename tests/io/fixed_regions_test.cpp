// A random scene that the camera moves past, with and without things that move with the camera.
#include "slam/io/fixed_regions.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

namespace sqslam {
namespace {

constexpr int kImages = 16;
const cv::Size kSize(320, 240);

cv::Mat Texture(cv::Size size, std::uint64_t seed) {
  cv::Mat texture(size, CV_8UC1);
  cv::RNG(seed).fill(texture, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(texture, texture, {}, 2.0);
  cv::normalize(texture, texture, 0, 255, cv::NORM_MINMAX);
  return texture;
}

// `speed`: px from image to image.
std::vector<cv::Mat> Film(int speed) {
  const cv::Mat scene = Texture({kSize.width + speed * kImages, kSize.height}, 1);
  std::vector<cv::Mat> film;
  for (int i = 0; i < kImages; ++i) {
    film.push_back(scene(cv::Rect({speed * i, 0}, kSize)).clone());
  }
  return film;
}

const cv::Rect kBonnet(0, 180, 320, 60);

std::vector<cv::Mat> FilmFromCar() {
  std::vector<cv::Mat> film = Film(20);
  const cv::Mat bonnet = Texture(kBonnet.size(), 2);
  for (int i = 0; i < kImages; ++i) {
    const double light = 0.8 + 0.4 * i / kImages;
    bonnet.convertTo(film[i](kBonnet), CV_8U, light);
  }
  return film;
}

double Share(const cv::Mat& regions) { return cv::mean(regions != 0)[0] / 255.0; }

TEST(FixedRegions, FindsWhatMovesWithCamera) {
  const cv::Mat regions = FixedRegions(FilmFromCar());
  ASSERT_EQ(regions.size(), kSize);
  EXPECT_GT(Share(regions(kBonnet)), 0.9);
  constexpr int kReach = 20;  // px
  EXPECT_EQ(Share(regions(cv::Rect(0, 0, kSize.width, kBonnet.y - kReach))), 0.0);
}

TEST(FixedRegions, FindsNothingWhenAllMoves) { EXPECT_TRUE(FixedRegions(Film(20)).empty()); }

TEST(FixedRegions, FindsNothingWhenCameraStandsStill) { EXPECT_TRUE(FixedRegions(Film(0)).empty()); }

TEST(FixedRegions, FindsNothingInFewImages) {
  std::vector<cv::Mat> film = FilmFromCar();
  film.resize(kImages / 2);
  EXPECT_TRUE(FixedRegions(film).empty());
}

}  // namespace
}  // namespace sqslam
