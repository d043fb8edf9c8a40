#include "slam/detection/background_detector.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <future>
#include <opencv2/imgproc.hpp>
#include <thread>
#include <utility>

#include "slam/util/error.h"
#include "tests/detection/hand_made_network.h"

namespace sqslam {
namespace {
namespace fs = std::filesystem;
using testing::ElementsAre;

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

  // A blue block that moves one cell to the right with every fourth frame.
  static Frame FrameAt(int index) {
    Frame frame;
    frame.index = 10 + index;
    frame.timestamp = 0.1 * index;
    frame.bgr = cv::Mat(32, 64, CV_8UC3, cv::Scalar::all(0));
    cv::Mat(frame.bgr, cv::Rect(20 + 4 * (index / 4 % 6), 12, 4, 4)).setTo(cv::Scalar(230, 0, 0));
    cv::cvtColor(frame.bgr, frame.gray, cv::COLOR_BGR2GRAY);
    return frame;
  }

  BackgroundDetector Make(int interval, DetectionPace pace) const {
    return {std::make_shared<Detector>(network_), {"", interval}, pace};
  }

  fs::path file_;
  NetworkOptions network_;
};

// Says the left half of every image.
class LeftHalf : public ObjectDetector {
 public:
  std::vector<Detection> Detect(const cv::Mat& bgr) override {
    return {{"half", 1.0, {0.0, 0.0, 0.5 * bgr.cols, 1.0 * bgr.rows}}};
  }
};

TEST_F(BackgroundDetectorTest, FindsUprightBoxesInTurnedFrames) {
  Frame frame = FrameAt(0);  // 64 x 32
  frame.quarter_turns = 3;   // what is left in the upright image is below in the frame
  BackgroundDetector detector(std::make_shared<LeftHalf>(), {"", 1}, DetectionPace::kEveryNth);
  detector.Add(frame);
  const std::vector<FrameBoxes> boxes = detector.Finish();
  ASSERT_EQ(boxes.size(), 1U);
  EXPECT_EQ(boxes[0].quarter_turns, 3);
  ASSERT_EQ(boxes[0].detections.size(), 1U);
  const Box2d& box = boxes[0].detections[0].box;
  EXPECT_EQ(box.x, 0.0);
  EXPECT_EQ(box.y, 16.0);
  EXPECT_EQ(box.width, 64.0);
  EXPECT_EQ(box.height, 16.0);
}

TEST_F(BackgroundDetectorTest, ReturnsEveryFrameOnceInOrder) {
  for (const DetectionPace pace : {DetectionPace::kNewest, DetectionPace::kEveryNth}) {
    BackgroundDetector detector = Make(0, pace);
    std::vector<FrameBoxes> all;
    const auto take = [&](const std::vector<FrameBoxes>& some) {
      all.insert(all.end(), some.begin(), some.end());
    };
    for (int i = 0; i < 50; ++i) {
      take(detector.Add(FrameAt(i)));
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
    EXPECT_TRUE(detector.Finish().empty());
  }
}

// The network sees the same frames, and their boxes are returned at the same frames, whatever the speed.
TEST_F(BackgroundDetectorTest, RecordingWaitsForEveryNthFrame) {
  for (const bool slowly : {false, true}) {
    BackgroundDetector detector = Make(4, DetectionPace::kEveryNth);
    std::vector<std::size_t> handed_over;
    std::vector<FrameBoxes> all;
    for (int i = 0; i < 11; ++i) {
      const std::vector<FrameBoxes> boxes = detector.Add(FrameAt(i));
      handed_over.push_back(boxes.size());
      all.insert(all.end(), boxes.begin(), boxes.end());
      if (slowly) {
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
      }
    }
    EXPECT_THAT(handed_over, ElementsAre(0, 0, 0, 0, 1, 0, 0, 0, 4, 0, 0));
    const std::vector<FrameBoxes> rest = detector.Finish();
    EXPECT_EQ(rest.size(), 6U);
    all.insert(all.end(), rest.begin(), rest.end());
    for (std::size_t i = 0; i < all.size(); ++i) {
      EXPECT_EQ(all[i].seen, i % 4 == 0 || i == 10) << i;
      EXPECT_EQ(all[i].detections.size(), 1U) << i;
    }
  }
}

TEST_F(BackgroundDetectorTest, TracksBoxesThroughFramesBetween) {
  BackgroundDetector detector = Make(4, DetectionPace::kEveryNth);
  for (int i = 0; i < 5; ++i) {
    detector.Add(FrameAt(i));
  }
  const std::vector<FrameBoxes> boxes = detector.Finish();
  ASSERT_EQ(boxes.size(), 4U);
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    ASSERT_EQ(boxes[i].detections.size(), 1U);
    const double moved = boxes[i].detections[0].box.Center().x() - 20.0;
    EXPECT_NEAR(moved, i == 3 ? 4.0 : 0.0, 1.5) << "the block stands still until the last frame, " << i;
    EXPECT_EQ(boxes[i].seen, i == 3);
  }
}

TEST_F(BackgroundDetectorTest, DropsBoxesAcrossLongGaps) {
  constexpr int kInterval = 95;
  BackgroundDetector detector = Make(kInterval, DetectionPace::kEveryNth);
  for (int i = 0; i <= kInterval; ++i) {
    detector.Add(FrameAt(i));
  }
  const std::vector<FrameBoxes> last = detector.Finish();
  ASSERT_EQ(last.size(), static_cast<std::size_t>(kInterval));
  EXPECT_TRUE(last.front().detections.empty());
  EXPECT_FALSE(last.back().detections.empty());
}

// Blocks on the first image until the test releases it.
class HeldDetector : public ObjectDetector {
 public:
  std::vector<Detection> Detect(const cv::Mat&) override {
    if (!std::exchange(held_, true)) {
      started.set_value();
      released.get_future().wait();
    }
    return {};
  }
  std::string Settings() const override { return "held"; }

  std::promise<void> started, released;

 private:
  bool held_ = false;
};

TEST(SlowBackgroundDetector, KeepsFewImagesOfLiveCamera) {
  const auto slow = std::make_shared<HeldDetector>();
  BackgroundDetector detector(slow, {}, DetectionPace::kNewest);
  std::vector<Frame> frames(201);
  const auto kept = [&](cv::Mat Frame::*image) {
    return std::ranges::count_if(frames, [&](const Frame& f) {
      return !(f.*image).empty() && (f.*image).u->refcount > 1;  // by the detector too
    });
  };
  for (std::size_t i = 0; i < frames.size(); ++i) {
    frames[i].bgr = cv::Mat(8, 8, CV_8UC3, cv::Scalar::all(0));
    frames[i].gray = cv::Mat(8, 8, CV_8UC1, cv::Scalar::all(0));
    detector.Add(frames[i]);
    if (i == 0) {
      slow->started.get_future().wait();
    } else if (i == 90) {
      EXPECT_EQ(kept(&Frame::bgr), 2) << "what the network sees now and next";
      EXPECT_EQ(kept(&Frame::gray), 91) << "boxes can be tracked through them";
    }
  }
  EXPECT_EQ(kept(&Frame::bgr), 2);
  EXPECT_EQ(kept(&Frame::gray), 2);
  slow->released.set_value();
  EXPECT_EQ(detector.Finish().size(), 201U);
}

// Images of a size that the letterbox cannot fill make OpenCV throw on the detector's thread.
TEST_F(BackgroundDetectorTest, RethrowsErrorsOfTheThread) {
  BackgroundDetector detector = Make(1, DetectionPace::kEveryNth);
  Frame frame;
  frame.bgr = cv::Mat(4, 4, CV_32FC1, cv::Scalar(0));
  detector.Add(frame);
  EXPECT_ANY_THROW(detector.Add(frame));
}

TEST_F(BackgroundDetectorTest, StopsWhenDestroyedAtWork) {
  BackgroundDetector detector = Make(1, DetectionPace::kNewest);
  for (int i = 0; i < 20; ++i) {
    detector.Add(FrameAt(i));
  }
}

}  // namespace
}  // namespace sqslam
