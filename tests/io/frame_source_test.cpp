#include "slam/io/frame_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <opencv2/imgcodecs.hpp>

#include "slam/util/error.h"
#include "slam/util/limits.h"
#include "tests/io/captured_log.h"
#include "tests/io/temporary_folder.h"

namespace sqslam {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class FrameSourceTest : public ::testing::Test {
 protected:
  FrameSourceTest() {
    sequence_.camera = {64, 48, 50.0, 50.0, 32.0, 24.0, {}, 30.0};
    for (int i = 0; i < 8; ++i) {
      const auto path = folder_.Path() / (std::to_string(i) + ".png");
      cv::imwrite(path.string(), cv::Mat(48, 64, CV_8UC3, cv::Scalar(10 * i, 0, 0)));
      sequence_.frames.push_back({0.1 * i, path, {}});
    }
  }

  std::vector<int> Play(FrameSource& source) const {
    std::vector<int> indices;
    while (const std::optional<Frame> frame = source.Next()) {
      EXPECT_EQ(frame->bgr.at<cv::Vec3b>(0, 0)[0], 10 * frame->index);
      EXPECT_EQ(frame->gray.size(), cv::Size(64, 48));
      indices.push_back(static_cast<int>(frame->index));
    }
    return indices;
  }

  TemporaryFolder folder_;
  Sequence sequence_;
};

TEST_F(FrameSourceTest, PlaysAllFramesInOrder) {
  FrameSource source(sequence_, {}, 2);
  EXPECT_THAT(Play(source), ElementsAre(0, 1, 2, 3, 4, 5, 6, 7));
  EXPECT_FALSE(source.Next().has_value());
}

TEST_F(FrameSourceTest, PlaysFramesByStartCountAndStride) {
  const FrameRange range{.start = 1, .count = 3, .stride = 2};
  FrameSource source(sequence_, range);
  EXPECT_THAT(Play(source), ElementsAre(1, 3, 5));
  EXPECT_EQ(range.SizeIn(sequence_), 3);
  EXPECT_EQ((FrameRange{.start = 6, .stride = 2}.SizeIn(sequence_)), 1);
  EXPECT_EQ((FrameRange{.start = 9}.SizeIn(sequence_)), 0);
}

TEST_F(FrameSourceTest, ParsesFramesAsCountOrRange) {
  const auto played = [&](const std::string& frames, std::optional<std::int64_t> start, std::int64_t stride) {
    FrameSource source(sequence_, ParseFrameRange(frames, start, stride));
    return Play(source);
  };
  EXPECT_THAT(played("3", {}, 1), ElementsAre(0, 1, 2));
  EXPECT_THAT(played("3", 2, 2), ElementsAre(2, 4, 6));
  EXPECT_THAT(played("2:5", {}, 1), ElementsAre(2, 3, 4));
  EXPECT_THAT(played("2:7", {}, 2), ElementsAre(2, 4, 6));
  EXPECT_THAT(played("2:6", {}, 2), ElementsAre(2, 4));
  EXPECT_THAT(played(":2", {}, 1), ElementsAre(0, 1));
  EXPECT_THAT(played(":5", 3, 1), ElementsAre(3, 4));
  EXPECT_THAT(played("6:", {}, 1), ElementsAre(6, 7));
  EXPECT_THAT(played(":", 6, 1), ElementsAre(6, 7));
  EXPECT_THAT(played("", 6, 1), ElementsAre(6, 7));
  for (const char* wrong : {"0", "-1", "a", "1.5", "3:3", "5:2", "1:2:3", "a:", ":0", "1:b"}) {
    EXPECT_THROW(ParseFrameRange(wrong), UsageError) << wrong;
  }
  EXPECT_THROW(ParseFrameRange("2:5", 1), UsageError);
}

TEST_F(FrameSourceTest, SkipsFolderInPlaceOfImage) {
  sequence_.frames[1].image_path = sequence_.frames[1].image_path.parent_path();  // a list cut off in a line
  const CapturedLog log;
  FrameSource source(sequence_);
  EXPECT_THAT(Play(source), ElementsAre(0, 2, 3, 4, 5, 6, 7));
  EXPECT_EQ(source.Skipped(), 1);
  EXPECT_THAT(log.Text(), HasSubstr("frame 1 skipped"));
}

TEST_F(FrameSourceTest, LeavesWarningsToAnotherSource) {
  sequence_.frames[1].image_path = sequence_.frames[1].image_path.parent_path();
  const CapturedLog log;
  FrameSource source(sequence_);
  source.Mute();
  EXPECT_THAT(Play(source), ElementsAre(0, 2, 3, 4, 5, 6, 7));
  EXPECT_EQ(source.Skipped(), 1);
  EXPECT_EQ(log.Text(), "");
}

TEST_F(FrameSourceTest, SkipsDevicesAndEndlessFiles) {
  sequence_.frames[1].image_path = "/dev/null";  // as /dev/zero, which would take all memory
  std::filesystem::resize_file(sequence_.frames[2].image_path, kMaxFileBytes + 1);  // of zeros
  const CapturedLog log;
  FrameSource source(sequence_);
  EXPECT_THAT(Play(source), ElementsAre(0, 3, 4, 5, 6, 7));
  EXPECT_THAT(log.Text(), HasSubstr("frame 1 skipped: /dev/null is not a regular file"));
  EXPECT_THAT(log.Text(), HasSubstr("2.png cannot be read"));
}

TEST_F(FrameSourceTest, SkipsUnusableImagesByName) {
  const CapturedLog log;
  std::filesystem::remove(sequence_.frames[1].image_path);
  folder_.Write("2.png", "this is no image");
  cv::imwrite(sequence_.frames[3].image_path.string(), cv::Mat(24, 32, CV_8UC3, cv::Scalar()));
  folder_.Write("4.png", "");
  cv::Mat noise(48, 64, CV_8UC3);
  cv::randu(noise, 0, 255);
  std::vector<unsigned char> jpeg;
  cv::imencode(".jpg", noise, jpeg);
  folder_.Write("5.png", std::string(jpeg.begin(), jpeg.begin() + std::ssize(jpeg) / 2));
  std::vector<unsigned char> png;
  cv::imencode(".png", noise, png);
  folder_.Write("6.png", std::string(png.begin(), png.begin() + std::ssize(png) / 2));
  std::string large(jpeg.begin(), jpeg.end());
  large.replace(large.find("\xFF\xC0") + 5, 4, "\xFD\xE8\xFD\xE8");  // claims 65000 by 65000 pixels
  folder_.Write("7.png", large);
  FrameSource source(sequence_);
  EXPECT_THAT(Play(source), ElementsAre(0));
  EXPECT_EQ(source.Skipped(), 7);
  EXPECT_THAT(log.Text(),
              HasSubstr("frame 1 skipped: " + sequence_.frames[1].image_path.string() + " cannot be opened"));
  EXPECT_THAT(log.Text(), HasSubstr("frame 2 skipped"));
  EXPECT_THAT(log.Text(), HasSubstr("is 32x24, expected the camera's 64x48"));
  EXPECT_THAT(log.Text(), HasSubstr("5.png is cut off"));
  EXPECT_THAT(log.Text(), HasSubstr("7.png is too large, expected at most 16384 pixels a side"));
}

TEST_F(FrameSourceTest, IgnoresBlackPixelsOfMasks) {
  cv::Mat mask(48, 64, CV_8UC1, cv::Scalar(255));
  mask(cv::Rect(0, 0, 64, 10)).setTo(0);
  const std::filesystem::path masks = folder_.Path() / "masks";
  std::filesystem::create_directories(masks);
  for (const int i : {0, 2, 3}) {
    cv::imwrite((masks / (std::to_string(i) + ".png.png")).string(), i == 3 ? cv::Mat(mask, {0, 20}) : mask);
  }
  for (int i = 0; i < 8; ++i) {
    sequence_.frames[i].mask_path = i == 0 || i == 3 ? masks / (std::to_string(i) + ".png.png") : "";
  }
  const CapturedLog log;
  FrameSource source(sequence_);
  EXPECT_EQ(cv::countNonZero(source.Next()->ignored), 640);
  EXPECT_TRUE(source.Next()->ignored.empty());
  EXPECT_TRUE(source.Next()->ignored.empty());
  EXPECT_TRUE(source.Next()->ignored.empty());
  EXPECT_THAT(log.Text(), HasSubstr("frame 3 has no mask"));

  folder_.Write("camera.yaml", "width: 64\nheight: 48\nfx: 50\nfy: 50\ncx: 32\ncy: 24\n");
  const auto masks_found = [&](const std::filesystem::path& path) {
    const Sequence sequence = OpenSequence({.path = folder_.Path(), .mask = path});
    return std::ranges::count_if(sequence.frames, [](const auto& f) { return !f.mask_path.empty(); });
  };
  EXPECT_EQ(masks_found(masks), 3);
  EXPECT_EQ(masks_found(masks / "0.png.png"), 8);
  EXPECT_THROW(masks_found(folder_.Path() / "nowhere"), InputError);
  std::filesystem::create_directories(folder_.Path() / "none");
  EXPECT_THROW(masks_found(folder_.Path() / "none"), InputError);
}

TEST_F(FrameSourceTest, StopsBeforeTheEnd) {
  FrameSource source(sequence_, {}, 1);
  EXPECT_TRUE(source.Next().has_value());
}  // the test ends, which it would not if the thread were not joined

}  // namespace
}  // namespace sqslam
