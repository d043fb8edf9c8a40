#include "slam/tracking/ignored_regions.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

namespace sqslam {
namespace {

Frame FrameAt(double timestamp) {
  Frame frame;
  frame.timestamp = timestamp;
  frame.gray = cv::Mat::zeros(100, 200, CV_8UC1);
  return frame;
}

MovingOptions Options() {
  MovingOptions options;
  options.labels = {"person"};
  options.margin = 0.1;
  options.hold = 0.3;
  return options;
}

TEST(IgnoredRegions, AreTheBoxesOfWhatMovesALittleLarger) {
  IgnoredRegions regions(Options());
  EXPECT_TRUE(regions.In(FrameAt(1.0)).empty());
  regions.See(1.0, {{"person", 0.9, {50.0, 20.0, 40.0, 50.0}},
                    {"cup", 0.9, {150.0, 20.0, 20.0, 20.0}},
                    {"person", 0.1, {0.0, 0.0, 20.0, 20.0}}});
  const cv::Mat ignored = regions.In(FrameAt(1.0));
  EXPECT_EQ(cv::boundingRect(ignored), cv::Rect(46, 15, 48, 60));
  EXPECT_EQ(cv::countNonZero(ignored), 48 * 60);
}

TEST(IgnoredRegions, BoxesHoldUntilTheyAreTooOld) {
  IgnoredRegions regions(Options());
  regions.See(1.0, {{"person", 0.9, {50.0, 20.0, 40.0, 50.0}}});
  regions.See(1.1, {});  // missed
  EXPECT_FALSE(regions.In(FrameAt(1.2)).empty());
  EXPECT_TRUE(regions.In(FrameAt(1.4)).empty());
  regions.See(1.2, {{"person", 0.9, {150.0, 20.0, 40.0, 50.0}}});
  regions.See(1.1, {{"person", 0.9, {10.0, 20.0, 40.0, 50.0}}});  // late
  EXPECT_EQ(cv::boundingRect(regions.In(FrameAt(1.3))).x, 146);
}

TEST(IgnoredRegions, WhatFillsTheImageIsWhatIsFilmed) {
  IgnoredRegions regions(Options());
  regions.See(1.0, {{"person", 0.9, {0.0, 0.0, 180.0, 100.0}}});
  EXPECT_TRUE(regions.In(FrameAt(1.0)).empty());
}

TEST(IgnoredRegions, JoinTheMask) {
  IgnoredRegions regions(Options());
  Frame frame = FrameAt(1.0);
  frame.ignored = cv::Mat::zeros(100, 200, CV_8UC1);
  frame.ignored(cv::Rect(0, 90, 200, 10)).setTo(255);
  EXPECT_EQ(cv::countNonZero(regions.In(frame)), 2000);
  regions.See(1.0, {{"person", 0.9, {50.0, 20.0, 40.0, 50.0}}});
  EXPECT_EQ(cv::countNonZero(regions.In(frame)), 2000 + 48 * 60);
  EXPECT_EQ(cv::countNonZero(frame.ignored), 2000);  // the frame's own stays
}

}  // namespace
}  // namespace sqslam
