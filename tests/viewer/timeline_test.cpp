#include "app/viewer/frames/timeline.h"

#include <gtest/gtest.h>

namespace sqslam::viewer {
namespace {

Timeline TenSeconds() {
  Timeline timeline;
  for (int i = 0; i <= 100; ++i) {
    timeline.moments.push_back({i, 5.0 + 0.1 * i, i / 10});
  }
  return timeline;
}

TEST(TimelineTest, FindsNewestMomentAtTime) {
  const Timeline timeline = TenSeconds();
  EXPECT_EQ(timeline.At(0.0), 0);
  EXPECT_EQ(timeline.At(5.0), 0);
  EXPECT_EQ(timeline.At(6.05), 10);
  EXPECT_EQ(timeline.At(99.0), 100);
  EXPECT_EQ(timeline.OfSnapshot(3), 30);
  EXPECT_EQ(Timeline().At(1.0), -1);
}

TEST(TimelineTest, HasGapsWithoutPoses) {
  Timeline timeline = TenSeconds();
  EXPECT_TRUE(timeline.Gaps().empty());
  for (const int frame : {3, 4, 5, 99, 100}) {
    timeline.moments[static_cast<std::size_t>(frame)].tracked = false;
  }
  const auto gaps = timeline.Gaps();
  ASSERT_EQ(gaps.size(), 2U);
  EXPECT_NEAR(gaps[0].first, 5.3, 1e-9);
  EXPECT_NEAR(gaps[0].second, 5.6, 1e-9) << "to the first frame that is there again";
  EXPECT_NEAR(gaps[1].second, timeline.End(), 1e-9);
}

TEST(PlaybackTest, PlaysBothWaysAndStopsAtEnds) {
  const Timeline timeline = TenSeconds();
  Playback playback;
  playback.time = timeline.End();
  playback.Toggle(1.0, timeline);
  EXPECT_EQ(playback.time, 5.0);  // begins again
  playback.speed = 2.0;
  playback.Advance(1.0, timeline);
  EXPECT_DOUBLE_EQ(playback.time, 7.0);
  playback.speed = -1.0;
  playback.Advance(1.5, timeline);
  EXPECT_DOUBLE_EQ(playback.time, 5.5);
  EXPECT_TRUE(playback.playing);
  playback.Advance(9.0, timeline);
  EXPECT_DOUBLE_EQ(playback.time, 5.0);
  EXPECT_FALSE(playback.playing);
}

TEST(PlaybackTest, StepsByFramesAndSnapshots) {
  const Timeline timeline = TenSeconds();
  Playback playback;
  playback.time = 6.0;
  playback.Step(1, timeline);
  EXPECT_EQ(timeline.At(playback.time), 11);
  playback.StepSnapshot(1, timeline);
  EXPECT_EQ(timeline.At(playback.time), 20);
  playback.StepSnapshot(-1, timeline);
  EXPECT_EQ(timeline.At(playback.time), 10);
  playback.Step(-99, timeline);
  EXPECT_EQ(timeline.At(playback.time), 0);
}

}  // namespace
}  // namespace sqslam::viewer
