#include "slam/util/stage_times.h"

#include <gtest/gtest.h>

namespace sqslam {
namespace {

TEST(StageTimes, SummarizesEachStage) {
  StageTimes times;
  for (const double milliseconds : {4.0, 1.0, 2.0, 3.0, 90.0}) {
    times.Add("tracking", milliseconds);
  }
  times.Add("mapping", 7.0);
  const auto summaries = times.Summaries();
  ASSERT_EQ(summaries.size(), 2U);
  const StageTimes::Summary& tracking = summaries.at("tracking");
  EXPECT_DOUBLE_EQ(tracking.mean, 20.0);
  EXPECT_DOUBLE_EQ(tracking.median, 3.0);
  EXPECT_DOUBLE_EQ(tracking.p95, 90.0);
  EXPECT_DOUBLE_EQ(tracking.max, 90.0);
  EXPECT_EQ(tracking.count, 5);
  EXPECT_DOUBLE_EQ(summaries.at("mapping").mean, 7.0);
}

// Hours of frames: the durations are thinned out, over the whole time alike.
TEST(StageTimes, SamplesEvenlyInLongRuns) {
  constexpr int kCount = 300000;
  StageTimes times;
  for (int i = 0; i < kCount; ++i) {
    times.Add("tracking", i + 1.0);
  }
  const StageTimes::Summary summary = times.Summaries().at("tracking");
  EXPECT_EQ(summary.count, kCount);
  EXPECT_DOUBLE_EQ(summary.max, kCount);
  EXPECT_NEAR(summary.mean, kCount / 2.0, 1.0);
  EXPECT_NEAR(summary.median, 0.5 * kCount, 0.001 * kCount);
  EXPECT_NEAR(summary.p95, 0.95 * kCount, 0.001 * kCount);
}

}  // namespace
}  // namespace sqslam
