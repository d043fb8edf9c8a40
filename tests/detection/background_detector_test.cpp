#include "slam/detection/background_detector.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <opencv2/imgproc.hpp>

#include "slam/util/error.h"
#include "tests/detection/hand_made_network.h"

namespace sqslam {
namespace {
namespace fs = std::filesystem;

class BackgroundDetectorTest : public testing::Test {
 protected:
  void SetUp() override {
    file_ = fs::temp_directory_path() / ("sqslam-background-" + std::to_string(::getpid()) + ".onnx");
    std::ofstream(file_, std::ios::binary) << HandMadeNetwork::ChannelsAsClasses();
    network_.file = file_.string();
    network_.decoder = NetworkDecoder::kCenterNet;
    network_.outputs = {"heatmap", "ltrb"};
    network_.classes = {"cup", "book", "apple"};
    network_.width = 64;
    network_.height = 32;
    network_.scale = 1.0 / 255.0;
    network_.threshold = 0.5;
  }
  void TearDown() override { fs::remove(file_); }

  // A blue block that goes one cell to the right with every fourth frame.
  static Frame FrameAt(int index) {
    Frame frame;
    frame.index = 10 + index;
    frame.timestamp = 0.1 * index;
    frame.bgr = cv::Mat(32, 64, CV_8UC3, cv::Scalar::all(0));
    cv::Mat(frame.bgr, cv::Rect(20 + 4 * (index / 4 % 6), 12, 4, 4)).setTo(cv::Scalar(230, 0, 0));
    cv::cvtColor(frame.bgr, frame.gray, cv::COLOR_BGR2GRAY);
    return frame;
  }

  BackgroundDetector Make(int interval, bool follow, bool deterministic) const {
    return {Detector(network_), {"", interval, follow}, deterministic};
  }

  fs::path file_;
  NetworkOptions network_;
};

TEST_F(BackgroundDetectorTest, EveryFrameComesOnceAndInOrder) {
  for (const bool deterministic : {false, true}) {
    BackgroundDetector detector = Make(0, true, deterministic);
    std::vector<FrameBoxes> all;
    const auto take = [&](const std::vector<FrameBoxes>& some) {
      all.insert(all.end(), some.begin(), some.end());
    };
    for (int i = 0; i < 50; ++i) {
      detector.Add(FrameAt(i));
      take(detector.Take());
    }
    take(detector.Finish());
    ASSERT_EQ(all.size(), 50U);
    for (int i = 0; i < 50; ++i) {
      EXPECT_EQ(all[static_cast<std::size_t>(i)].frame_index, 10 + i);
      EXPECT_DOUBLE_EQ(all[static_cast<std::size_t>(i)].timestamp, 0.1 * i);
    }
    EXPECT_TRUE(all.back().seen);
    ASSERT_EQ(all.back().detections.size(), 1U);
    EXPECT_NEAR(all.back().detections[0].box.x, 20 + 4 * (49 / 4 % 6) - 8, 1e-3);
    EXPECT_TRUE(detector.Take().empty());
  }
}

TEST_F(BackgroundDetectorTest, DeterministicRunsWaitForEveryNthFrame) {
  BackgroundDetector detector = Make(4, false, true);
  for (int i = 0; i < 9; ++i) {
    detector.Add(FrameAt(i));
    const std::vector<FrameBoxes> boxes = detector.Take();
    if (i % 4 == 0) {
      ASSERT_EQ(boxes.size(), i == 0 ? 1U : 4U) << i;
      EXPECT_TRUE(boxes.back().seen);
      EXPECT_EQ(boxes.back().detections.size(), 1U);
      EXPECT_TRUE(i == 0 || boxes.front().detections.empty());  // nothing is carried
    } else {
      EXPECT_TRUE(boxes.empty()) << i;
    }
  }
}

TEST_F(BackgroundDetectorTest, FramesBetweenGetTheirBoxesFromTheirNeighbours) {
  BackgroundDetector detector = Make(4, true, true);
  detector.Add(FrameAt(0));
  const std::vector<FrameBoxes> first = detector.Take();
  ASSERT_EQ(first.size(), 1U);
  ASSERT_EQ(first[0].detections.size(), 1U);
  std::vector<FrameBoxes> last;
  for (int i = 1; i < 5; ++i) {
    detector.Add(FrameAt(i));
    last = detector.Take();
  }
  ASSERT_EQ(last.size(), 4U);
  const double start = first[0].detections[0].box.Center().x();
  for (std::size_t i = 0; i < last.size(); ++i) {
    ASSERT_EQ(last[i].detections.size(), 1U);
    const double moved = last[i].detections[0].box.Center().x() - start;
    EXPECT_NEAR(moved, i == 3 ? 4.0 : 0.0, 1.5) << "the block stands still until the last frame, " << i;
    EXPECT_EQ(last[i].seen, i == 3);
  }
}

TEST_F(BackgroundDetectorTest, BoxesAreNotCarriedOverLongGaps) {
  constexpr int kFar = 95;
  BackgroundDetector detector = Make(kFar, true, true);
  detector.Add(FrameAt(0));
  detector.Take();
  std::vector<FrameBoxes> last;
  for (int i = 1; i <= kFar; ++i) {
    detector.Add(FrameAt(i));
    last = detector.Take();
  }
  ASSERT_EQ(last.size(), static_cast<std::size_t>(kFar));
  EXPECT_TRUE(last.front().detections.empty());
  EXPECT_FALSE(last.back().detections.empty());
}

// Images of a size that the letterbox cannot fill make OpenCV throw on the detector's thread.
TEST_F(BackgroundDetectorTest, WhatFailsInTheBackgroundIsThrownInTheForeground) {
  BackgroundDetector detector = Make(1, true, true);
  Frame frame;
  frame.bgr = cv::Mat(4, 4, CV_32FC1, cv::Scalar(0));
  detector.Add(frame);
  EXPECT_ANY_THROW(detector.Take());
}

TEST_F(BackgroundDetectorTest, ItCanBeDroppedWhileAtWork) {
  BackgroundDetector detector = Make(1, true, false);
  for (int i = 0; i < 20; ++i) {
    detector.Add(FrameAt(i));
  }
}

}  // namespace
}  // namespace sqslam
