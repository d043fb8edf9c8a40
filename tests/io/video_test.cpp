#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "slam/io/cameras.h"
#include "slam/io/frame_source.h"
#include "slam/io/sequence.h"
#include "tests/io/captured_log.h"
#include "tests/io/temporary_folder.h"

namespace sqslam {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr int kFrames = 40;
constexpr double kVideoFps = 25.0;

struct Codec {
  const char* file;
  int fourcc;
};

// A video that the test writes itself: a white square that moves two pixels a frame on a dark, noisy ground
// (noise keeps the frames large, so that a file cut in half holds about half of them).
class VideoTest : public ::testing::TestWithParam<Codec> {
 protected:
  VideoTest() {
    ::setenv("OPENCV_FFMPEG_LOGLEVEL", "-8", 0);  // what the reader says is enough
    WriteCamera(folder_.Path() / "camera.yaml", {160, 120, 120.0, 120.0, 80.0, 60.0, {}, 30.0});
    cv::VideoWriter writer(Path().string(), cv::CAP_FFMPEG, GetParam().fourcc, kVideoFps, {160, 120});
    cv::RNG random(5);
    for (int i = 0; i < kFrames; ++i) {
      cv::Mat image(120, 160, CV_8UC3);
      random.fill(image, cv::RNG::UNIFORM, 0, 60);
      cv::rectangle(image, {Left(i), 40, 30, 40}, cv::Scalar::all(255), cv::FILLED);
      writer.write(image);
    }
  }
  static int Left(int frame) { return 10 + 2 * frame; }
  std::filesystem::path Path() const { return folder_.Path() / GetParam().file; }
  void CutOffAfter(double share) const {
    const auto size = static_cast<double>(std::filesystem::file_size(Path()));
    std::filesystem::resize_file(Path(), static_cast<std::uintmax_t>(share * size));
  }

  TemporaryFolder folder_;
};

// The left edge of the square in the row through its middle, pixels.
int LeftEdge(const Frame& frame) {
  int x = 0;
  while (x < frame.gray.cols && frame.gray.at<std::uint8_t>(60, x) < 150) {
    ++x;
  }
  return x;
}

TEST_P(VideoTest, PlaysFramesInOrderWithTheirTimes) {
  const Sequence sequence = OpenSequence({.path = Path(), .resize = "1"});
  EXPECT_EQ(sequence.format, SequenceFormat::kVideo);
  ASSERT_EQ(sequence.frames.size(), static_cast<std::size_t>(kFrames));
  FrameSource source(sequence);
  int count = 0;
  while (const std::optional<Frame> frame = source.Next()) {
    EXPECT_EQ(frame->index, count);
    EXPECT_NEAR(frame->timestamp, count / kVideoFps, 1e-9);
    EXPECT_NEAR(LeftEdge(*frame), Left(count), 1);
    ++count;
  }
  EXPECT_EQ(count, kFrames);
  EXPECT_EQ(source.Skipped(), 0);
}

TEST_P(VideoTest, PlaysFramesByStartAndStride) {
  FrameSource source(OpenSequence({.path = Path(), .resize = "1"}), {.start = 3, .count = 3, .stride = 5});
  for (const int index : {3, 8, 13}) {
    const std::optional<Frame> frame = source.Next();
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->index, index);
    EXPECT_NEAR(LeftEdge(*frame), Left(index), 1);
  }
  EXPECT_FALSE(source.Next());
}

TEST_P(VideoTest, ScalesCalibrationOfSameAspectRatio) {
  const Camera camera = OpenSequence({.path = Path(), .camera = "kinect-v1", .resize = "1"}).camera;
  EXPECT_EQ(camera.width, 160);
  EXPECT_NEAR(camera.fx, 0.25 * ReadCamera(CameraFile("kinect-v1")).fx, 1e-9);
  const fs::path wide = Path().parent_path() / "wide.yaml";
  std::ofstream(wide) << "width: 640\nheight: 360\nfx: 500\nfy: 500\ncx: 320\ncy: 180\n";
  EXPECT_THAT(InputErrorOf([&] { OpenSequence({.path = Path(), .camera = wide.string()}); }),
              AllOf(HasSubstr("is 160x120, expected the camera's 640x360 or its aspect ratio"),
                    HasSubstr("--camera auto")));
}

TEST_P(VideoTest, PlaysFirstPartWhenCutOff) {
  CutOffAfter(0.5);
  if (GetParam().file == std::string("film.mp4")) {  // its index stood at the end: nothing can be read
    EXPECT_THAT(InputErrorOf([&] { OpenSequence({.path = Path()}); }),
                HasSubstr("film.mp4: cannot be read as a video (damaged, cut off, or not a video)"));
    return;
  }
  const CapturedLog log;
  const Sequence sequence = OpenSequence({.path = Path(), .resize = "1"});
  FrameSource source(sequence);
  int count = 0;
  while (source.Next()) {
    ++count;
  }
  EXPECT_GT(count, kFrames / 4);
  EXPECT_LT(count, 3 * kFrames / 4);
  EXPECT_EQ(count + source.Skipped(), static_cast<int>(sequence.frames.size()));
  EXPECT_THAT(log.Text(), AllOf(HasSubstr("film.avi: ends after " + std::to_string(count) + " of its"),
                                HasSubstr("damaged or cut off")));
}

INSTANTIATE_TEST_SUITE_P(Codecs, VideoTest,
                         ::testing::Values(Codec{"film.avi", cv::VideoWriter::fourcc('M', 'J', 'P', 'G')},
                                           Codec{"film.mp4", cv::VideoWriter::fourcc('m', 'p', '4', 'v')}),
                         [](const auto& info) { return std::string(info.param.file).substr(5); });

}  // namespace
}  // namespace sqslam
