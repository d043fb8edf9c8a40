#include "render/gl/screen_tiles.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>

namespace sqslam {
namespace {

// Returns how often the areas cover each pixel of a target.
cv::Mat1i Covered(const std::vector<cv::Rect>& areas, cv::Size target) {
  cv::Mat1i times(target, 0);
  for (const cv::Rect& area : areas) {
    times(area) += 1;
  }
  return times;
}

TEST(ScreenTilesTest, MarkedAndOtherAreasCoverEachPixelOnce) {
  const cv::Size picture(75, 50);
  ScreenTiles tiles(picture);
  tiles.Mark({Eigen::Vector2d(20.0, 3.0), Eigen::Vector2d(40.0, 20.0)});
  tiles.Mark({Eigen::Vector2d(35.0, 30.0), Eigen::Vector2d(500.0, 500.0)});
  tiles.Mark({Eigen::Vector2d(-500.0, 0.0), Eigen::Vector2d(-1.0, 500.0)});  // beside the picture
  for (const int step : {1, 2}) {
    const cv::Size target((picture.width + step - 1) / step, (picture.height + step - 1) / step);
    const cv::Mat1i marked = Covered(tiles.Areas(true, step), target);
    EXPECT_EQ(cv::countNonZero(marked + Covered(tiles.Areas(false, step), target) != 1), 0);
    EXPECT_EQ(marked(20 / step, 40 / step), 1);
    EXPECT_EQ(marked(49 / step, 74 / step), 1);
    EXPECT_EQ(marked(0, 0), 0);
    EXPECT_EQ(marked(8 / step, 60 / step), 0);
  }
}

TEST(ScreenTilesTest, EqualRunsAreOneArea) {
  ScreenTiles tiles({64, 64});
  EXPECT_TRUE(tiles.Areas(true).empty());
  EXPECT_EQ(tiles.Areas(false), std::vector{cv::Rect(0, 0, 64, 64)});
  tiles.Mark({Eigen::Vector2d(17.0, 17.0), Eigen::Vector2d(47.0, 47.0)});
  EXPECT_EQ(tiles.Areas(true), std::vector{cv::Rect(16, 16, 32, 32)});
}

TEST(ScreenTilesTest, ABoxBehindTheCameraMayBeAnywhere) {
  Eigen::Matrix4d perspective = Eigen::Matrix4d::Zero();  // near plane 1, far plane infinitely far
  perspective.diagonal() << 1.0, 1.0, -1.0, 0.0;
  perspective(2, 3) = -2.0;
  perspective(3, 2) = -1.0;
  const Eigen::AlignedBox3d ahead(Eigen::Vector3d(-1.0, 0.0, -4.0), Eigen::Vector3d(1.0, 1.0, -2.0));
  const Eigen::AlignedBox2d seen = SeenPart(ahead, perspective, {200, 100});
  EXPECT_TRUE(seen.min().isApprox(Eigen::Vector2d(50.0, 50.0)));
  EXPECT_TRUE(seen.max().isApprox(Eigen::Vector2d(150.0, 75.0)));
  const Eigen::AlignedBox3d around(Eigen::Vector3d(-1.0, 0.0, -4.0), Eigen::Vector3d(1.0, 1.0, 2.0));
  EXPECT_TRUE(SeenPart(around, perspective, {200, 100}).sizes().isApprox(Eigen::Vector2d(200.0, 100.0)));
}

}  // namespace
}  // namespace sqslam
