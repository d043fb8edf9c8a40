#include "slam/dense/cloud_pieces.h"

#include <gtest/gtest.h>

namespace sqslam {
namespace {

// A wall two metres ahead of a camera that stands `aside`, and nothing else.
DepthMap Wall(double aside = 0.0) {
  DepthMap map;
  map.camera = {160, 120, 150.0, 150.0, 80.0, 60.0, {}, 30.0};
  map.T_map_camera.translation.x() = aside;
  map.depth = cv::Mat(120, 160, CV_32F, cv::Scalar(0));
  map.depth(cv::Rect(40, 20, 80, 80)).setTo(2.0F);
  map.views = cv::Mat(120, 160, CV_8U, cv::Scalar(3));
  return map;
}

int Points(const DepthMap& map, const cv::Rect& part) { return cv::countNonZero(map.depth(part) > 0.0F); }

DepthMap Sifted(const std::vector<DepthMap>& maps, double min_pixels) {
  CloudPieces pieces;
  for (const DepthMap& map : maps) {
    pieces.Add(map);
  }
  pieces.Join(min_pixels);
  DepthMap sifted = maps.front();
  sifted.depth = maps.front().depth.clone();
  pieces.DropSmall(sifted);
  return sifted;
}

constexpr int kWall = 80 * 80;

TEST(CloudPieces, RemovesIsolatedPointsAndKeepsSurfaces) {
  DepthMap map = Wall();
  map.depth(cv::Rect(60, 60, 6, 6)).setTo(1.0F);  // floats a metre before the wall
  const DepthMap sifted = Sifted({map}, 200.0);
  EXPECT_EQ(Points(sifted, {60, 60, 6, 6}), 0);
  EXPECT_EQ(sifted.views.at<std::uint8_t>(62, 62), 0);
  EXPECT_EQ(Points(sifted, {0, 0, 160, 120}), kWall - 36);
  EXPECT_EQ(Points(Sifted({map}, 0.0), {0, 0, 160, 120}), kWall);  // none is too small
}

TEST(CloudPieces, KeepsPatchThatOtherMapsSurround) {
  DepthMap patch = Wall();
  patch.depth.setTo(0.0F);
  patch.depth(cv::Rect(70, 50, 6, 6)).setTo(2.0F);
  EXPECT_EQ(Points(Sifted({patch}, 200.0), {70, 50, 6, 6}), 0);
  EXPECT_EQ(Points(Sifted({patch, Wall(0.1)}, 200.0), {70, 50, 6, 6}), 36);
}

TEST(CloudPieces, ConnectsPointsOfDistantSurfaces) {
  DepthMap map = Wall();
  map.depth(cv::Rect(0, 0, 30, 30)).setTo(40.0F);
  EXPECT_EQ(Points(Sifted({map}, 600.0), {0, 0, 30, 30}), 900);
}

TEST(CloudPieces, ConnectsSurfaceSeenFromNearAndFar) {
  DepthMap near = Wall();
  near.T_map_camera.translation.z() = 1.7;  // 0.3 m before the wall, a few pixels of it
  near.depth.setTo(0.0F);
  near.depth(cv::Rect(78, 58, 5, 5)).setTo(0.3F);
  EXPECT_EQ(Points(Sifted({near, Wall()}, 200.0), {78, 58, 5, 5}), 25);
}

}  // namespace
}  // namespace sqslam
