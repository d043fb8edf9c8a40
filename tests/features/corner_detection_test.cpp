#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>
#include <vector>

#include "slam/features/corners.h"

namespace sqslam {
namespace {

const cv::Rect kInner(10, 10, 128, 64);  // 4 x 2 cells

cv::Mat GrayImage() { return cv::Mat(84, 148, CV_8UC1, cv::Scalar(100)); }

// A bright pixel, which FAST finds exactly there, at a place relative to kInner.
void AddDot(cv::Mat& image, const cv::Point& place, int contrast) {
  image.at<std::uint8_t>(place + kInner.tl()) += static_cast<std::uint8_t>(contrast);
}

std::vector<cv::Point> PlacesOf(const std::vector<cv::KeyPoint>& corners) {
  std::vector<cv::Point> places;
  for (const cv::KeyPoint& corner : corners) {
    places.emplace_back(corner.pt);
  }
  return places;
}

TEST(CornerDetector, FindsCornersUpToEdgesOfInnerArea) {
  cv::Mat image = GrayImage();
  const std::vector<cv::Point> dots{{0, 0}, {127, 0}, {40, 20}, {0, 63}, {127, 63}};
  for (const cv::Point& dot : dots) {
    AddDot(image, dot, 80);
  }
  AddDot(image, {-1, 30}, 80);
  EXPECT_EQ(PlacesOf(CornerDetector(20, 7).Detect(image, kInner)), dots);
}

TEST(CornerDetector, TriesLowerThresholdOnlyInEmptyCells) {
  cv::Mat image = GrayImage();
  AddDot(image, {40, 10}, 80);   // cell (1, 0) has a strong corner
  AddDot(image, {50, 20}, 12);   // so that this one is not wanted
  AddDot(image, {10, 10}, 12);   // cell (0, 0)
  AddDot(image, {100, 10}, 12);  // cell (3, 0)
  AddDot(image, {64, 50}, 12);   // at the edge of cell (2, 1)
  AddDot(image, {20, 50}, 5);    // too weak
  EXPECT_EQ(PlacesOf(CornerDetector(20, 7).Detect(image, kInner)),
            (std::vector<cv::Point>{{40, 10}, {10, 10}, {100, 10}, {64, 50}}));
}

TEST(CornerDetector, FindsEachCornerOnceWhereCellsMeet) {
  cv::Mat image = GrayImage();
  cv::rectangle(image, kInner.tl() + cv::Point(32, 10), kInner.tl() + cv::Point(33, 11), 200, cv::FILLED);
  AddDot(image, {32, 10}, 40);
  EXPECT_EQ(PlacesOf(CornerDetector(20, 7).Detect(image, kInner)), (std::vector<cv::Point>{{32, 10}}));
}

TEST(CornerDetector, FindsNothingInAreaSmallerThanCell) {
  cv::Mat image = GrayImage();
  AddDot(image, {10, 10}, 80);
  EXPECT_TRUE(CornerDetector(20, 7).Detect(image, {10, 10, 31, 64}).empty());
}

TEST(CornerDetector, DiscardsCornersOfPreviousImage) {
  cv::Mat image = GrayImage();
  AddDot(image, {40, 10}, 80);
  CornerDetector detector(20, 7);
  EXPECT_EQ(detector.Detect(image, kInner).size(), 1U);
  EXPECT_TRUE(detector.Detect(GrayImage(), kInner).empty());
}

}  // namespace
}  // namespace sqslam
