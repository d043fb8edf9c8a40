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

MovingOptions Options() { return {{"person"}}; }

TEST(IgnoredRegions, CoversEnlargedBoxesOfMovingObjects) {
  IgnoredRegions regions(Options());
  EXPECT_TRUE(regions.MaskOf(FrameAt(1.0)).empty());
  regions.AddDetections(1.0, {{"person", 0.9, {50.0, 20.0, 40.0, 50.0}},
                              {"cup", 0.9, {150.0, 20.0, 20.0, 20.0}},
                              {"person", 0.1, {0.0, 0.0, 20.0, 20.0}}});
  const cv::Mat ignored = regions.MaskOf(FrameAt(1.0));
  EXPECT_EQ(cv::boundingRect(ignored), cv::Rect(48, 17, 44, 56));
  EXPECT_EQ(cv::countNonZero(ignored), 44 * 56);
}

TEST(IgnoredRegions, KeepsBoxesUntilTheyAreTooOld) {
  IgnoredRegions regions(Options());
  regions.AddDetections(1.0, {{"person", 0.9, {50.0, 20.0, 40.0, 50.0}}});
  regions.AddDetections(1.1, {});  // missed
  EXPECT_FALSE(regions.MaskOf(FrameAt(1.2)).empty());
  EXPECT_TRUE(regions.MaskOf(FrameAt(1.4)).empty());
  regions.AddDetections(1.2, {{"person", 0.9, {150.0, 20.0, 40.0, 50.0}}});
  regions.AddDetections(1.1, {{"person", 0.9, {10.0, 20.0, 40.0, 50.0}}});  // late
  EXPECT_EQ(cv::boundingRect(regions.MaskOf(FrameAt(1.3))).x, 148);
}

TEST(IgnoredRegions, IgnoresBoxThatFillsTheImage) {
  IgnoredRegions regions(Options());
  regions.AddDetections(1.0, {{"person", 0.9, {0.0, 0.0, 180.0, 100.0}}});
  EXPECT_TRUE(regions.MaskOf(FrameAt(1.0)).empty());
}

TEST(IgnoredRegions, AddsBoxesToTheMask) {
  IgnoredRegions regions(Options());
  Frame frame = FrameAt(1.0);
  frame.ignored = cv::Mat::zeros(100, 200, CV_8UC1);
  frame.ignored(cv::Rect(0, 90, 200, 10)).setTo(255);
  EXPECT_EQ(cv::countNonZero(regions.MaskOf(frame)), 2000);
  regions.AddDetections(1.0, {{"person", 0.9, {50.0, 20.0, 40.0, 50.0}}});
  EXPECT_EQ(cv::countNonZero(regions.MaskOf(frame)), 2000 + 44 * 56);
  EXPECT_EQ(cv::countNonZero(frame.ignored), 2000);  // the frame's own stays
}

}  // namespace
}  // namespace sqslam
