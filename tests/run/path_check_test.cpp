#include "slam/run/path_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace sqslam {
namespace {

using ::testing::HasSubstr;

// A walk at 30 frames a second, 1 cm a frame, with some sway.
Trajectory Walk(int frames) {
  Trajectory walk;
  for (int i = 0; i < frames; ++i) {
    walk.push_back({i / 30.0, {{1, 0, 0, 0}, {0.01 * i, 0.004 * std::sin(0.7 * i), 0.0}}});
  }
  return walk;
}

TEST(FindJumps, AcceptsWalk) {
  EXPECT_TRUE(FindJumps(Walk(200)).empty());
  EXPECT_TRUE(FindJumps({}).empty());
  EXPECT_TRUE(FindJumps(Walk(3)).empty());
}

TEST(FindJumps, AcceptsCameraThatBeginsToMoveFast) {
  Trajectory walk = Walk(200);
  for (int i = 0; i < 200; ++i) {
    walk[i].T_map_camera.translation.x() = i < 100 ? 1e-4 * i : 0.05 * (i - 100);
  }
  EXPECT_TRUE(FindJumps(walk).empty());
}

TEST(FindJumps, AcceptsGapInTime) {
  Trajectory walk = Walk(200);
  walk.erase(walk.begin() + 100, walk.begin() + 150);
  EXPECT_TRUE(FindJumps(walk).empty());
}

TEST(FindJumps, FindsPartThatIsElsewhere) {
  Trajectory walk = Walk(200);
  for (int i = 120; i < 200; ++i) {
    walk[i].T_map_camera.translation.y() += 0.8;
  }
  const std::vector<PathJump> jumps = FindJumps(walk);
  ASSERT_EQ(jumps.size(), 1U);
  EXPECT_NEAR(jumps[0].before, 119 / 30.0, 1e-9);
  EXPECT_NEAR(jumps[0].after, 4.0, 1e-9);
  EXPECT_GT(jumps[0].times, 50.0);
  EXPECT_THAT(InWords(jumps), HasSubstr("3.967 to 4.000 s"));
}

TEST(FindJumps, FindsSingleWrongPose) {
  Trajectory walk = Walk(200);
  walk[60].T_map_camera.translation.z() = 2.0;
  EXPECT_EQ(FindJumps(walk).size(), 2U) << "there and back";
}

}  // namespace
}  // namespace sqslam
