#include "render/gl/screen_tiles.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>

namespace sqslam {
namespace {

constexpr TileContent kEmpty = TileContent::kBackground;
constexpr TileContent kDrawn = TileContent::kDeep;
constexpr TileContent kSolid = TileContent::kNearSolid;

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
  tiles.Mark({Eigen::Vector2d(20.0, 3.0), Eigen::Vector2d(40.0, 20.0)}, kSolid);
  tiles.Mark({Eigen::Vector2d(35.0, 30.0), Eigen::Vector2d(500.0, 500.0)}, kSolid);
  tiles.Mark({Eigen::Vector2d(-500.0, 0.0), Eigen::Vector2d(-1.0, 500.0)}, kSolid);  // beside the picture
  for (const int step : {1, 2}) {
    const cv::Size target((picture.width + step - 1) / step, (picture.height + step - 1) / step);
    const cv::Mat1i marked = Covered(tiles.Areas(kSolid, kSolid, step), target);
    EXPECT_EQ(cv::countNonZero(marked + Covered(tiles.Areas(kEmpty, kDrawn, step), target) != 1), 0);
    EXPECT_EQ(marked(20 / step, 40 / step), 1);
    EXPECT_EQ(marked(49 / step, 74 / step), 1);
    EXPECT_EQ(marked(0, 0), 0);
    EXPECT_EQ(marked(8 / step, 60 / step), 0);
  }
}

TEST(ScreenTilesTest, EqualRunsAreOneArea) {
  ScreenTiles tiles({64, 64});
  EXPECT_TRUE(tiles.Areas(kDrawn, kSolid).empty());
  EXPECT_EQ(tiles.Areas(kEmpty, kEmpty), std::vector{cv::Rect(0, 0, 64, 64)});
  tiles.Mark({Eigen::Vector2d(17.0, 17.0), Eigen::Vector2d(47.0, 47.0)}, kSolid);
  EXPECT_EQ(tiles.Areas(kDrawn, kSolid), std::vector{cv::Rect(16, 16, 32, 32)});
}

TEST(ScreenTilesTest, AMarkNeverTakesAwayFromATile) {
  ScreenTiles tiles({64, 64});
  tiles.Mark({Eigen::Vector2d(17.0, 17.0), Eigen::Vector2d(20.0, 20.0)}, kSolid);
  tiles.Mark({Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(64.0, 64.0)}, kDrawn);
  EXPECT_EQ(tiles.Areas(kSolid, kSolid), std::vector{cv::Rect(16, 16, 16, 16)});
  EXPECT_EQ(tiles.Areas(kDrawn, kSolid), std::vector{cv::Rect(0, 0, 64, 64)});
}

TEST(ScreenTilesTest, ALineMarksWhatItTouches) {
  ScreenTiles tiles({160, 160});
  tiles.MarkLine({5.0, 5.0}, {155.0, 155.0}, 1.0, kDrawn);
  const cv::Mat1i marked = Covered(tiles.Areas(kDrawn, kDrawn), {160, 160});
  for (int i = 5; i < 155; ++i) {
    EXPECT_EQ(marked(i, i + 1), 1);
  }
  EXPECT_EQ(marked(150, 10), 0);
  EXPECT_LT(cv::countNonZero(marked), 160 * 160 / 2);
}

TEST(ScreenTilesTest, PointsMarkTheirTilesAndThoseNextToThem) {
  ScreenTiles tiles({64, 64});
  cv::Mat1f depths(128, 128, 1.0F);
  depths(40, 62) = 0.5F;  // in the second tile, in the last pixel before the third
  tiles.MarkPoints(depths, 2, kDrawn);
  EXPECT_EQ(tiles.Areas(kDrawn, kDrawn), std::vector{cv::Rect(16, 16, 32, 16)});
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
