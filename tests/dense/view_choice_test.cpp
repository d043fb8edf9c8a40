#include "slam/dense/view_choice.h"

#include <gtest/gtest.h>

#include <cmath>

namespace sqslam {
namespace {

const Camera kCamera{320, 240, 260.0, 260.0, 160.0, 120.0, {}, 30.0};

// A wall two units ahead.
std::vector<Eigen::Vector3d> Wall() {
  std::vector<Eigen::Vector3d> points;
  for (int i = -20; i <= 20; ++i) {
    for (int j = -15; j <= 15; ++j) {
      points.push_back({0.05 * i, 0.05 * j, 2.0});
    }
  }
  return points;
}

// Places on a line before it, a centimetre from each to the next: about 0.29 degrees.
std::vector<PosedFrame> Line(int count) {
  std::vector<PosedFrame> frames;
  for (int i = 0; i < count; ++i) {
    frames.push_back({i, {Eigen::Quaterniond::Identity(), {0.01 * (i - count / 2), 0.0, 0.0}}});
  }
  return frames;
}

TEST(ViewChoice, ChoosesViewsOnBothSidesAtWantedAngles) {
  const std::vector<PosedFrame> frames = Line(101);
  const PosedFrame& keyframe = frames[50];
  const auto in_view = PointsInView(Wall(), kCamera, keyframe.T_map_camera, 100);
  EXPECT_EQ(in_view.size(), 100U);
  const auto views = ChooseViews(keyframe, frames, in_view, kCamera, {6.0, 3.0}, {});
  ASSERT_EQ(views.size(), 4U);
  int left = 0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const Parallax parallax =
        ParallaxOf(in_view, kCamera, keyframe.T_map_camera, frames[views[i]].T_map_camera);
    EXPECT_NEAR(parallax.angle, i < 2 ? 6.0 : 3.0, 0.8);
    left += views[i] < 50 ? 1 : 0;
  }
  EXPECT_EQ(left, 2);
}

TEST(ViewChoice, SkipsFramesFarInTimeOrOnTheSpot) {
  const std::vector<PosedFrame> frames = Line(101);
  const auto in_view = PointsInView(Wall(), kCamera, frames[50].T_map_camera, 100);
  ViewOptions options;
  options.window = 2;  // at most 0.6 degrees
  EXPECT_TRUE(ChooseViews(frames[50], frames, in_view, kCamera, {6.0, 3.0}, options).empty());
}

TEST(ViewChoice, DepthRangeContainsAllPoints) {
  std::vector<Eigen::Vector3d> points = Wall();
  for (int i = 0; i < 400; ++i) {
    points.push_back({0.001 * i - 0.2, 0.0, 1.0});
  }
  points.push_back({0.0, 0.0, 0.01});  // an outlier
  points.push_back({0.0, 0.0, 500.0});
  const auto in_view = PointsInView(points, kCamera, {}, 10000);
  const auto range = RangeOf(in_view, {});
  ASSERT_TRUE(range);
  EXPECT_NEAR(range->nearest, 1.0 / 1.25, 1e-9);
  EXPECT_NEAR(range->farthest, 2.0 / 0.75, 1e-9);
  EXPECT_FALSE(RangeOf({{0.0, 0.0, 1.0}}, {}));
}

TEST(ViewChoice, ChoosesNeighboursThatSeeTheSame) {
  std::vector<PosedFrame> keyframes = Line(5);
  keyframes.push_back({9, {Eigen::Quaterniond(Eigen::AngleAxisd(3.1, Eigen::Vector3d::UnitY())), {0, 0, 0}}});
  const auto in_view = PointsInView(Wall(), kCamera, keyframes[2].T_map_camera, 100);
  const auto neighbours = ChooseNeighbours(2, keyframes, in_view, kCamera, 8);
  EXPECT_EQ(neighbours.size(), 4U);  // not itself, not the one that looks away
}

}  // namespace
}  // namespace sqslam
