#include "slam/util/statistics.h"

#include <gtest/gtest.h>

#include <random>

namespace sqslam {
namespace {

std::vector<double> Shuffled(int count) {
  std::vector<double> values;
  for (int i = 0; i < count; ++i) {
    values.push_back(10.0 * i);
  }
  std::shuffle(values.begin(), values.end(), std::mt19937(7));
  return values;
}

TEST(Statistics, FindsValueOfRank) {
  std::vector<int> values = {5, 1, 4, 2, 3};
  for (std::size_t rank = 0; rank < 5; ++rank) {
    EXPECT_EQ(NthSmallest(values, rank), static_cast<int>(rank) + 1);
  }
}

TEST(Statistics, MediansDifferForEvenCountsOnly) {
  EXPECT_EQ(UpperMedian(Shuffled(5)), 20.0);
  EXPECT_EQ(MeanMedian(Shuffled(5)), 20.0);
  EXPECT_EQ(UpperMedian(Shuffled(6)), 30.0);
  EXPECT_EQ(MeanMedian(Shuffled(6)), 25.0);
  EXPECT_EQ(UpperMedian(Shuffled(1)), 0.0);
  EXPECT_EQ(MeanMedian(Shuffled(1)), 0.0);
}

TEST(Statistics, QuantilesRoundDownRoundOrInterpolate) {
  const std::vector<double> values = Shuffled(11);  // a tenth of the range from one to the next
  EXPECT_EQ(LowerQuantile(values, 0.57), 50.0);
  EXPECT_EQ(NearestQuantile(values, 0.57), 60.0);
  EXPECT_NEAR(LinearQuantile(values, 0.57), 57.0, 1e-12);
  for (const double q : {0.0, 1.0}) {
    EXPECT_EQ(LowerQuantile(values, q), 100.0 * q);
    EXPECT_EQ(NearestQuantile(values, q), 100.0 * q);
    EXPECT_EQ(LinearQuantile(values, q), 100.0 * q);
  }
}

}  // namespace
}  // namespace sqslam
