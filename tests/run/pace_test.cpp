#include "slam/run/pace.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

namespace sqslam {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::Le;

// A clock that stands still except in Pace's sleep and where the test says that work took time.
struct TestClock {
  double time = 1000.0;
  std::vector<double> sleeps;
  bool stopped = false;

  PaceClock AsPaceClock() {
    return {[this] { return time; },
            [this](double seconds) {
              sleeps.push_back(seconds);
              time += seconds;
            },
            [this] { return stopped; }};
  }
};

// Plays ten frames, ten a second, each of which takes `work` seconds; returns those that were admitted.
std::vector<int> Play(TestClock& clock, Pace& pace, double work) {
  std::vector<int> admitted;
  for (int i = 0; i < 10; ++i) {
    if (pace.Admit(50.0 + 0.1 * i, i < 9 ? std::optional(50.0 + 0.1 * (i + 1)) : std::nullopt)) {
      admitted.push_back(i);
      clock.time += work;
    }
  }
  return admitted;
}

TEST(Pace, WaitsForEachFrameWhenFast) {
  TestClock clock;
  Pace pace(clock.AsPaceClock());
  EXPECT_THAT(Play(clock, pace, 0.03), ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8, 9));
  EXPECT_EQ(pace.Dropped(), 0);
  EXPECT_NEAR(clock.time, 1000.0 + 0.9 + 0.03, 1e-9);  // the last frame's time, and its work
}

TEST(Pace, SkipsToNewestFrameWhenSlow) {
  TestClock clock;
  Pace pace(clock.AsPaceClock());
  // Done at 0.25 s (frame 2 is the newest), 0.5 (5, just there), 0.75 (7), 1.0 (9).
  EXPECT_THAT(Play(clock, pace, 0.2501), ElementsAre(0, 2, 5, 7, 9));
  EXPECT_EQ(pace.Dropped(), 5);
  EXPECT_THAT(clock.sleeps, ElementsAre());
}

TEST(Pace, DeliversSomeFramesWhenReadingIsSlow) {
  TestClock clock;
  Pace pace(clock.AsPaceClock());
  std::vector<int> admitted;
  for (int i = 0; i < 20; ++i) {
    if (pace.Admit(0.1 * i, 0.1 * (i + 1))) {
      admitted.push_back(i);
    }
    clock.time += 0.201;  // to read the next one
  }
  EXPECT_THAT(admitted, ElementsAre(0, 4, 8, 12, 16));
}

TEST(Pace, DropsOnlyFramesDuringSlowFrame) {
  TestClock clock;
  Pace pace(clock.AsPaceClock());
  EXPECT_TRUE(pace.Admit(0.0, 0.1));
  clock.time += 0.32;
  EXPECT_FALSE(pace.Admit(0.1, 0.2));
  EXPECT_FALSE(pace.Admit(0.2, 0.3));
  EXPECT_TRUE(pace.Admit(0.3, 0.4));
  EXPECT_TRUE(pace.Admit(0.4, 0.5));
  EXPECT_EQ(pace.Dropped(), 2);
  EXPECT_NEAR(clock.time, 1000.4, 1e-9);  // on time again
}

TEST(Pace, NeverDropsLastFrame) {
  TestClock clock;
  Pace pace(clock.AsPaceClock());
  EXPECT_TRUE(pace.Admit(0.0, 0.1));
  clock.time += 50.0;
  EXPECT_TRUE(pace.Admit(0.1, std::nullopt));
}

TEST(Pace, StopsWaitingWhenInterrupted) {
  TestClock clock;
  PaceClock paced = clock.AsPaceClock();
  paced.stop = [&] { return clock.time > 1000.5; };
  Pace pace(paced);
  EXPECT_TRUE(pace.Admit(0.0, 3600.0));
  EXPECT_TRUE(pace.Admit(3600.0, std::nullopt));
  EXPECT_LT(clock.time, 1001.0);
  EXPECT_THAT(clock.sleeps, Each(Le(0.1)));
}

}  // namespace
}  // namespace sqslam
