#include "slam/io/time_unit.h"

#include <gtest/gtest.h>

#include <string>

namespace sqslam {
namespace {

std::string NameOfUnit(const std::vector<double>& times, bool written_whole = false) {
  return UnitOfTimes(times, written_whole, 25.0).name;
}

TEST(UnitOfTimes, RecognisesUnixTime) {
  EXPECT_EQ(NameOfUnit({1305031102.1, 1305031112.1}), "seconds");
  EXPECT_EQ(NameOfUnit({1.7e12, 1.700000000033e12}), "milliseconds");
  EXPECT_EQ(NameOfUnit({1.7e15, 1.700000000033333e15}), "microseconds");
  EXPECT_EQ(NameOfUnit({1.7e18, 1.700000000033333333e18}), "nanoseconds");
}

TEST(UnitOfTimes, RecognisesSteps) {
  EXPECT_EQ(NameOfUnit({0.0, 0.033, 0.067}), "seconds");
  EXPECT_EQ(NameOfUnit({0.0, 33.3, 66.7}), "milliseconds");
  EXPECT_EQ(NameOfUnit({0, 8, 17, 25}, true), "milliseconds");
  EXPECT_EQ(NameOfUnit({0.5, 8.5, 17.0, 25.5}), "seconds") << "few images of a long film";
  EXPECT_EQ(NameOfUnit({0, 33333, 66667}), "microseconds");
  EXPECT_EQ(NameOfUnit({0, 33333333, 66666667, 9e9}), "nanoseconds");
  EXPECT_EQ(NameOfUnit({17}), "seconds");
}

TEST(UnitOfTimes, RecognisesFrameNumbers) {
  EXPECT_EQ(NameOfUnit({1, 2, 3, 7}, true), "frame numbers");
  EXPECT_NEAR(UnitOfTimes({1, 2, 3}, true, 25.0).seconds, 0.04, 1e-12);
  EXPECT_EQ(NameOfUnit({1, 2, 3}), "seconds");  // written as 1.0, 2.0, 3.0
  EXPECT_EQ(NameOfUnit({1305031102, 1305031103}, true), "seconds");
}

}  // namespace
}  // namespace sqslam
