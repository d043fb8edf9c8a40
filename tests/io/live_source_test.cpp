#include "slam/io/live_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <thread>

#include "tests/io/captured_log.h"
#include "tests/io/temporary_folder.h"

namespace sqslam {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

const Camera kSmallCamera{64, 48, 50.0, 50.0, 32.0, 24.0, {}, 30.0};

// Gives `count` images whose grey value is their index, then none. With a gate it waits there before image
// `gate_at` and tells that it has come so far.
class FakeGrabber {
 public:
  explicit FakeGrabber(int count, cv::Size size = {64, 48}) : count_(count), size_(size) {}

  void WaitAt(int index, std::promise<void>& arrived, std::shared_future<void> gate) {
    gate_at_ = index;
    arrived_ = &arrived;
    gate_ = std::move(gate);
  }
  void FailAt(int index) { fail_at_ = index; }

  bool operator()(cv::Mat& bgr) {
    if (next_ == gate_at_) {
      arrived_->set_value();
      gate_.wait();
    }
    const int index = next_++;
    if (index >= count_ || index == fail_at_) {
      return false;
    }
    buffer_.create(size_, CV_8UC3);
    buffer_.setTo(cv::Scalar::all(index));  // one buffer for all, as drivers do
    bgr = buffer_;
    return true;
  }

 private:
  int count_;
  cv::Size size_;
  int next_ = 0;
  int gate_at_ = -1;
  int fail_at_ = -1;
  std::promise<void>* arrived_ = nullptr;
  std::shared_future<void> gate_;
  cv::Mat buffer_;
};

TEST(LiveSource, StopsWaitingForHangingCamera) {
  FakeGrabber grabber(5);
  std::promise<void> arrived;
  std::promise<void> gate;
  grabber.WaitAt(1, arrived, gate.get_future().share());
  std::atomic<bool> stopped = false;
  LiveSource source(std::move(grabber), kSmallCamera, "camera 0", {}, LiveClock(),
                    [&] { return stopped.load(); });
  EXPECT_TRUE(source.Next().has_value());
  arrived.get_future().wait();
  stopped = true;
  EXPECT_FALSE(source.Next().has_value());
  gate.set_value();
}

std::vector<int> Indices(LiveSource& source) {
  std::vector<int> indices;
  while (const std::optional<Frame> frame = source.Next()) {
    EXPECT_EQ(frame->bgr.at<cv::Vec3b>(0, 0)[0], frame->index);
    EXPECT_EQ(frame->gray.size(), cv::Size(64, 48));
    indices.push_back(static_cast<int>(frame->index));
  }
  return indices;
}

TEST(LiveSource, GivesNewestImageAndCountsDroppedOnes) {
  const CapturedLog log;
  std::promise<void> arrived;
  std::promise<void> open;
  FakeGrabber grabber(8);
  grabber.WaitAt(5, arrived, open.get_future().share());
  LiveSource source(std::move(grabber), kSmallCamera, "camera 0");
  arrived.get_future().wait();  // images 0 to 4 have come
  const std::optional<Frame> frame = source.Next();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->index, 4);
  EXPECT_EQ(source.Dropped(), 4);
  open.set_value();
  const std::vector<int> rest = Indices(source);
  ASSERT_FALSE(rest.empty());
  EXPECT_EQ(rest.back(), 7);  // the last one is not lost
  EXPECT_EQ(1 + static_cast<int>(rest.size()) + source.Dropped(), 8);
  EXPECT_THAT(log.Text(), HasSubstr("camera 0: delivers no more images after 8"));
}

TEST(LiveSource, StampsRisingTimesFromClock) {
  const CapturedLog log;
  std::promise<void> arrived;
  std::promise<void> open;
  FakeGrabber grabber(2);
  grabber.WaitAt(1, arrived, open.get_future().share());
  LiveSource source(std::move(grabber), kSmallCamera, "camera 0", {},
                    [] { return 12.5; });  // a clock that stands
  EXPECT_EQ(source.Next()->timestamp, 12.5);
  open.set_value();
  EXPECT_GT(source.Next()->timestamp, 12.5);
}

TEST(LiveSource, PicksImagesByStartStrideAndCount) {
  const CapturedLog log;
  std::promise<void> arrived;
  std::promise<void> open;
  FakeGrabber grabber(100);
  grabber.WaitAt(7, arrived, open.get_future().share());
  LiveSource source(std::move(grabber), kSmallCamera, "camera 0", {.start = 3, .count = 1, .stride = 2});
  arrived.get_future().wait();
  EXPECT_EQ(source.Next()->index, 5);  // of 3 and 5
  EXPECT_EQ(source.Dropped(), 1);
  EXPECT_FALSE(source.Next().has_value());
  open.set_value();
}

TEST(LiveSource, SkipsMissingImages) {
  const CapturedLog log;
  std::promise<void> arrived;
  std::promise<void> open;
  FakeGrabber grabber(4);
  grabber.FailAt(1);
  grabber.WaitAt(3, arrived, open.get_future().share());
  LiveSource source(std::move(grabber), kSmallCamera, "camera 0");
  arrived.get_future().wait();
  EXPECT_EQ(source.Next()->index, 2);
  EXPECT_EQ(source.Skipped(), 1);
  open.set_value();
  EXPECT_THAT(Indices(source), ElementsAre(3));
  EXPECT_EQ(source.Skipped(), 1);  // the end skips nothing
}

TEST(LiveSource, RefusesImagesOfAnotherSize) {
  EXPECT_THAT(
      InputErrorOf([] { LiveSource(FakeGrabber(1, cv::Size(32, 24)), kSmallCamera, "camera 0"); }),
      HasSubstr("camera 0: delivers images of 32x24 with 3 channels, expected the calibration's 64x48"));
  EXPECT_THAT(InputErrorOf([] { LiveSource(FakeGrabber(0), kSmallCamera, "camera 0"); }),
              HasSubstr("camera 0: delivers no image"));
}

TEST(LiveSource, ReportsMissingCamera) {
  constexpr int kNoSuchCamera = 987;
  EXPECT_THAT(InputErrorOf([] { OpenCamera(kNoSuchCamera, kSmallCamera); }),
              HasSubstr("camera 987: cannot be opened"));
}

}  // namespace
}  // namespace sqslam
