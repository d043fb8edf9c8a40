#include "slam/detection/box_tracking.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

namespace sqslam {
namespace {

// A textured card that moves over a textured wall, both of fixed random grey values.
class BoxFollowingTest : public testing::Test {
 protected:
  static cv::Mat Texture(cv::Size size, std::uint64_t seed, int low, int high) {
    cv::Mat noise(size, CV_8UC1);
    cv::RNG(seed).fill(noise, cv::RNG::UNIFORM, low, high);
    cv::Mat smooth;
    cv::GaussianBlur(noise, smooth, {}, 2.0);
    cv::normalize(smooth, smooth, low, high, cv::NORM_MINMAX);
    return smooth;
  }

  // Draws the card at `box`, with subpixel accuracy.
  cv::Mat Image(const Box2d& box) const {
    cv::Mat image = wall_.clone();
    const double growth = box.width / card_.cols;
    const cv::Matx23d motion(growth, 0, box.x, 0, growth, box.y);
    cv::warpAffine(card_, image, motion, image.size(), cv::INTER_LINEAR, cv::BORDER_TRANSPARENT);
    return image;
  }

  // Accelerates and approaches: a straight line between the ends would miss it.
  static Box2d BoxAt(int i) {
    const double size = 60.0 + i;
    return {40.0 + 1.2 * i * i, 50.0 + 0.8 * i * i, size, size};
  }

  std::vector<cv::Mat> Images(int count) const {
    std::vector<cv::Mat> images;
    for (int i = 0; i < count; ++i) {
      images.push_back(Image(BoxAt(i)));
    }
    return images;
  }

  cv::Mat wall_ = Texture({320, 240}, 1, 60, 120);
  cv::Mat card_ = Texture({60, 60}, 2, 0, 255);
};

TEST_F(BoxFollowingTest, FollowsTexture) {
  const std::vector<cv::Mat> images = Images(8);
  const auto between =
      TrackBoxes(images, {{"book", 0.4, BoxAt(0)}}, {{"cup", 0.9, {0, 0, 20, 20}}, {"book", 0.75, BoxAt(7)}});
  ASSERT_EQ(between.size(), 6U);
  for (int i = 1; i < 7; ++i) {
    const std::vector<Detection>& boxes = between[static_cast<std::size_t>(i) - 1];
    ASSERT_EQ(boxes.size(), 1U) << i;
    EXPECT_EQ(boxes[0].label, "book");
    EXPECT_NEAR(boxes[0].score, 0.4 + 0.05 * i, 1e-9);
    EXPECT_GT(IoU(boxes[0].box, BoxAt(i)), 0.95) << i;
  }
}

// The last box of the detector is off by some pixels: the track starts at the first box and ends at the last
// one.
TEST_F(BoxFollowingTest, SpreadsErrorOfLastBox) {
  const std::vector<cv::Mat> images = Images(5);
  Box2d last = BoxAt(4);
  last.x += 8.0;
  const auto between = TrackBoxes(images, {{"book", 0.5, BoxAt(0)}}, {{"book", 0.5, last}});
  for (int i = 1; i < 4; ++i) {
    EXPECT_NEAR(between[static_cast<std::size_t>(i) - 1].at(0).box.x, BoxAt(i).x + 2.0 * i, 1.0) << i;
  }
}

TEST_F(BoxFollowingTest, DropsBoxesWithoutPartner) {
  const std::vector<cv::Mat> images = Images(4);
  const std::vector<Detection> first = {{"book", 0.5, BoxAt(0)}};
  for (const std::vector<Detection>& last :
       {std::vector<Detection>{}, {{"cup", 0.5, BoxAt(3)}}, {{"book", 0.5, {200, 20, 60, 60}}}}) {
    for (const std::vector<Detection>& boxes : TrackBoxes(images, first, last)) {
      EXPECT_TRUE(boxes.empty());
    }
  }
}

TEST_F(BoxFollowingTest, InterpolatesOverlappingBoxesWithoutTexture) {
  const std::vector<cv::Mat> images(3, cv::Mat(240, 320, CV_8UC1, cv::Scalar(90)));
  const auto between = TrackBoxes(images, {{"tv", 0.5, {100, 50, 80, 60}}, {"cup", 0.5, {10, 50, 20, 20}}},
                                  {{"tv", 0.5, {110, 54, 90, 60}}, {"cup", 0.5, {60, 50, 20, 20}}});
  ASSERT_EQ(between.at(0).size(), 1U);
  EXPECT_NEAR(between[0][0].box.x, 105.0, 1e-9);
  EXPECT_NEAR(between[0][0].box.width, 85.0, 1e-9);
}

TEST_F(BoxFollowingTest, ReturnsNothingBetweenNeighbours) {
  EXPECT_TRUE(TrackBoxes(Images(2), {{"book", 0.5, BoxAt(0)}}, {{"book", 0.5, BoxAt(1)}}).empty());
}

}  // namespace
}  // namespace sqslam
