#include "tests/support/film.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "slam/io/cameras.h"
#include "slam/io/frame_source.h"
#include "slam/io/image_files.h"
#include "slam/io/video_index.h"
#include "tests/io/captured_log.h"
#include "tests/io/temporary_folder.h"

namespace sqslam {
namespace {

using ::testing::HasSubstr;
using testing::WriteFilm;

// A white square that moves two pixels a picture, on a noisy ground.
cv::Mat Picture(int i) {
  cv::Mat image(120, 160, CV_8UC3);
  cv::RNG random(static_cast<std::uint64_t>(i) + 1);
  random.fill(image, cv::RNG::UNIFORM, 0, 60);
  cv::rectangle(image, {10 + 2 * i, 40, 30, 40}, cv::Scalar::all(255), cv::FILLED);
  return image;
}

class FilmTest : public ::testing::Test {
 protected:
  FilmTest() { WriteCamera(folder_.Path() / "camera.yaml", {160, 120, 130.0, 120.0, 70.0, 55.0, {}, 30.0}); }
  std::filesystem::path Path() const { return folder_.Path() / "film.mp4"; }
  static std::vector<double> EvenTimes(int count) {
    std::vector<double> seconds;
    for (int i = 0; i < count; ++i) {
      seconds.push_back(i / 25.0);
    }
    return seconds;
  }
  TemporaryFolder folder_;
};

TEST_F(FilmTest, OpensFolderWithOneFilm) {
  WriteFilm(Path(), EvenTimes(5), Picture);
  const Sequence sequence = OpenSequence({.path = folder_.Path(), .resize = "1"});
  EXPECT_EQ(sequence.video_path, Path());
  EXPECT_EQ(sequence.frames.size(), 5U);
  folder_.Write("._film.mp4", "Mac OS X");
  EXPECT_EQ(OpenSequence({.path = folder_.Path(), .resize = "1"}).video_path, Path());
  WriteFilm(folder_.Path() / "second.mp4", EvenTimes(5), Picture);
  EXPECT_THROW(OpenSequence({.path = folder_.Path()}), InputError) << "which of the two?";
}

TEST_F(FilmTest, KeepsTimesOfVariableFrameRate) {
  const std::vector<double> seconds = {0.0, 0.040, 0.100, 0.133, 0.300, 0.310, 0.400, 0.900};
  WriteFilm(Path(), seconds, Picture);
  FrameSource source(OpenSequence({.path = Path(), .resize = "1"}));
  for (std::size_t i = 0; i < seconds.size(); ++i) {
    const std::optional<Frame> frame = source.Next();
    ASSERT_TRUE(frame) << i;
    EXPECT_NEAR(frame->timestamp, seconds[i], 1e-4);
    EXPECT_GT(frame->gray.at<std::uint8_t>(60, 25 + 2 * static_cast<int>(i)), 200);
    EXPECT_LT(frame->gray.at<std::uint8_t>(60, 5 + 2 * static_cast<int>(i)), 120);
  }
  EXPECT_FALSE(source.Next());
  EXPECT_EQ(source.Skipped(), 0);
}

TEST_F(FilmTest, RotatesPicturesAndCalibrationByFlag) {
  WriteFilm(Path(), EvenTimes(5), Picture, {.quarter_turns = 1});
  const Sequence sequence = OpenSequence({.path = Path(), .resize = "1"});
  EXPECT_EQ(sequence.camera.width, 120);
  EXPECT_EQ(sequence.camera.height, 160);
  EXPECT_EQ(sequence.camera.fx, 120.0);
  EXPECT_EQ(sequence.camera.fy, 130.0);
  EXPECT_EQ(sequence.camera.cx, 119.0 - 55.0);
  EXPECT_EQ(sequence.camera.cy, 70.0);
  FrameSource source(sequence);
  const std::optional<Frame> frame = source.Next();
  ASSERT_TRUE(frame);
  ASSERT_EQ(frame->gray.size(), cv::Size(120, 160));
  EXPECT_GT(frame->gray.at<std::uint8_t>(25, 59), 200);  // (25, 60) turned clockwise
  EXPECT_LT(frame->gray.at<std::uint8_t>(135, 59), 120);
}

TEST_F(FilmTest, KeepsCalibrationOfRotatedPictures) {
  WriteFilm(Path(), EvenTimes(3), Picture, {.quarter_turns = 3});
  WriteCamera(folder_.Path() / "camera.yaml", {120, 160, 130.0, 131.0, 60.0, 80.0, {}, 30.0});
  const Sequence sequence = OpenSequence({.path = Path(), .resize = "1"});
  EXPECT_EQ(sequence.camera.fy, 131.0);
  EXPECT_EQ(sequence.camera.cy, 80.0);
  FrameSource source(sequence);
  const std::optional<Frame> frame = source.Next();
  ASSERT_TRUE(frame);
  EXPECT_GT(frame->gray.at<std::uint8_t>(134, 60), 200);  // (25, 60) turned counter-clockwise
}

TEST_F(FilmTest, ResizesCalibrationAndBoxesWithImages) {
  WriteFilm(Path(), EvenTimes(3), Picture);
  const auto boxes = folder_.Write("boxes.txt", "0.0 book 0.9 10 40 30 40\n");
  const Sequence sequence = OpenSequence({.path = Path(), .detections = boxes, .resize = "0.5"});
  EXPECT_EQ(sequence.camera.width, 80);
  EXPECT_EQ(sequence.camera.height, 60);
  EXPECT_EQ(sequence.camera.fx, 65.0);
  EXPECT_EQ(sequence.camera.cx, 0.5 * 70.5 - 0.5);  // pixel centres lie at whole numbers
  ASSERT_EQ(sequence.frames[0].detections.size(), 1U);
  EXPECT_EQ(sequence.frames[0].detections[0].box.x, 5.0);
  EXPECT_EQ(sequence.frames[0].detections[0].box.width, 15.0);
  FrameSource source(sequence);
  const std::optional<Frame> frame = source.Next();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->bgr.size(), cv::Size(80, 60));
  EXPECT_GT(frame->gray.at<std::uint8_t>(30, 12), 200);
  EXPECT_EQ(OpenSequence({.path = Path(), .resize = "40"}).camera.height, 30);
  EXPECT_EQ(OpenSequence({.path = Path(), .resize = "64,64"}).camera.fy, 64.0);
  EXPECT_THROW(OpenSequence({.path = Path(), .resize = "1.5"}), UsageError);
  EXPECT_THROW(OpenSequence({.path = Path(), .resize = "64,"}), UsageError);
}

TEST_F(FilmTest, FindsFramesOfMapByItsCamera) {
  WriteFilm(Path(), EvenTimes(4), Picture);
  const Camera of_the_map = OpenSequence({.path = Path(), .resize = "80"}).camera;
  std::filesystem::remove(folder_.Path() / "camera.yaml");
  FrameSource source(OpenSequence({.path = Path(), .known_camera = of_the_map}), {.start = 2, .count = 1});
  const std::optional<Frame> frame = source.Next();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->bgr.size(), cv::Size(80, 60));
  EXPECT_GT(frame->gray.at<std::uint8_t>(30, 14), 200);
}

TEST_F(FilmTest, PlaysFirstPartWithWarningWhenCutOff) {
  constexpr int kFrames = 60;
  WriteFilm(Path(), EvenTimes(kFrames), Picture, {.index_first = true});
  std::filesystem::resize_file(Path(), std::filesystem::file_size(Path()) / 2);
  const CapturedLog log;
  const Sequence sequence = OpenSequence({.path = Path(), .resize = "1"});
  FrameSource source(sequence);
  int count = 0;
  while (source.Next()) {
    ++count;
  }
  EXPECT_GT(count, kFrames / 4);
  EXPECT_LT(count, 3 * kFrames / 4);
  EXPECT_THAT(log.Text(), HasSubstr("of its 60 frames; it may be damaged or cut off"));
}

TEST_F(FilmTest, RefusesFileWithoutIndex) {
  WriteFilm(Path(), EvenTimes(30), Picture);
  std::filesystem::resize_file(Path(), std::filesystem::file_size(Path()) / 2);
  EXPECT_THAT(InputErrorOf([&] { OpenSequence({.path = Path()}); }),
              HasSubstr("film.mp4: cannot be read as a video (damaged, cut off, or not a video"));
}

TEST_F(FilmTest, GuessesUncalibratedCamera) {
  std::filesystem::remove(folder_.Path() / "camera.yaml");
  WriteFilm(Path(), EvenTimes(3), Picture);
  for (const char* camera : {"", "auto"}) {
    const Sequence sequence = OpenSequence({.path = Path(), .camera = camera, .resize = "1"});
    EXPECT_NEAR(HorizontalFieldOfView(sequence.camera), 60.0 * 3.14159265 / 180.0, 1e-3);
    EXPECT_THAT(sequence.guessed_by, HasSubstr("60 degrees"));
  }
}

}  // namespace
}  // namespace sqslam
