// Folders of photographs of any size, taken with the camera upright or on its side.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "slam/io/cameras.h"
#include "slam/io/frame_source.h"
#include "slam/io/input_images.h"
#include "slam/io/sequence.h"
#include "tests/io/captured_log.h"
#include "tests/io/photograph.h"

namespace sqslam {
namespace {

// Pixels of a sensor of 64x48 with a white block.
cv::Mat SensorPixels() {
  cv::Mat pixels(48, 64, CV_8UC3, cv::Scalar::all(40));
  pixels(cv::Rect(6, 10, 20, 8)).setTo(cv::Scalar::all(250));
  return pixels;
}

cv::Rect BlockIn(const cv::Mat& gray) { return cv::boundingRect(gray > 145); }

class Photographs : public ::testing::Test {
 protected:
  // By name: taken upright or on either side, as stored by cameras and by programs that turn the pixels.
  void WriteMixed() const {
    WritePhotograph(folder_, "0.jpg", SensorPixels(), {});
    WritePhotograph(folder_, "1.jpg", SensorPixels(), {.orientation = 6});
    WritePhotograph(folder_, "2.jpg", SensorPixels(), {.orientation = 8});
    cv::imwrite((folder_.Path() / "3.png").string(), Turned(SensorPixels(), 1));
    WritePhotograph(folder_, "4.jpg", SensorPixels(), {});
    WritePhotograph(folder_, "5.jpg", SensorPixels(), {});
    WritePhotograph(folder_, "6.jpg", SensorPixels(), {});
  }
  static std::vector<Frame> Play(const Sequence& sequence) {
    FrameSource source(sequence);
    std::vector<Frame> frames;
    while (std::optional<Frame> frame = source.Next()) {
      frames.push_back(*frame);
    }
    EXPECT_EQ(source.Skipped(), 0);
    return frames;
  }

  TemporaryFolder folder_;
};

// Hidden files, thumbnails and unreadable files beside the images.
TEST_F(Photographs, KeepTheirNumbersBesideOtherFiles) {
  for (int i = 0; i < 6; ++i) {
    cv::imwrite((folder_.Path() / fmt::format("{}.png", i)).string(), SensorPixels());
  }
  folder_.Write("._0.png", "Mac OS X");
  folder_.Write("0 (damaged).png", "no image");
  cv::imwrite((folder_.Path() / "0_thumb.png").string(), cv::Mat(24, 32, CV_8UC3, cv::Scalar::all(0)));
  cv::imwrite((folder_.Path() / "0-copy.png").string(), SensorPixels());
  folder_.Write("2.png", "a frame that was lost");
  cv::imwrite((folder_.Path() / "3.png").string(), cv::Mat(24, 32, CV_8UC3, cv::Scalar::all(0)));
  const CapturedLog log;
  const Sequence sequence = OpenSequence({.path = folder_.Path(), .resize = "1"});
  std::vector<std::string> names;
  for (const SequenceFrame& frame : sequence.frames) {
    names.push_back(frame.image_path.filename().string());
  }
  EXPECT_THAT(names,
              ::testing::ElementsAre("0-copy.png", "0.png", "1.png", "2.png", "3.png", "4.png", "5.png"));
  EXPECT_EQ(sequence.camera.width, 64);
  EXPECT_THAT(log.Text(), ::testing::HasSubstr("2 of 9 files left out"));
}

TEST_F(Photographs, ScaleCalibrationOfSameAspectRatio) {
  for (int i = 0; i < 3; ++i) {
    cv::imwrite((folder_.Path() / fmt::format("{}.png", i)).string(), SensorPixels());
  }
  folder_.Write("camera.yaml", "width: 640\nheight: 480\nfx: 500\nfy: 510\ncx: 319.5\ncy: 239.5\n");
  const Sequence sequence = OpenSequence({.path = folder_.Path(), .resize = "1"});
  EXPECT_EQ(sequence.camera.width, 64);
  EXPECT_NEAR(sequence.camera.fy, 51.0, 1e-9);
  EXPECT_NEAR(sequence.camera.cx, 31.5, 1e-9);
  EXPECT_EQ(Play(sequence).size(), 3U);
  // A sensor's calibration, and images that were shown upright.
  folder_.Write("camera.yaml", "width: 480\nheight: 640\nfx: 500\nfy: 510\ncx: 239.5\ncy: 319.5\n");
  EXPECT_NEAR(OpenSequence({.path = folder_.Path(), .resize = "1"}).camera.fx, 51.0, 1e-9);
  folder_.Write("camera.yaml", "width: 640\nheight: 360\nfx: 500\nfy: 510\ncx: 319.5\ncy: 179.5\n");
  EXPECT_THAT(InputErrorOf([&] { OpenSequence({.path = folder_.Path()}); }),
              ::testing::HasSubstr("is 64x48, expected the camera's 640x360 or its aspect ratio"));
}

TEST_F(Photographs, UseTheRangeOfMoreThanEightBits) {
  for (int i = 0; i < 4; ++i) {
    cv::Mat deep(48, 64, CV_16UC1, cv::Scalar(29500));
    deep(cv::Rect(6, 10, 20, 8)).setTo(i == 3 ? 30100 : 30500);
    cv::imwrite((folder_.Path() / fmt::format("{}.png", i)).string(), deep);
  }
  const Sequence sequence = OpenSequence({.path = folder_.Path(), .resize = "1"});
  const std::vector<Frame> frames = Play(sequence);
  EXPECT_EQ(frames[0].gray.at<std::uint8_t>(0, 0), 0);
  EXPECT_EQ(frames[0].gray.at<std::uint8_t>(12, 10), 255);
  EXPECT_NEAR(frames[3].gray.at<std::uint8_t>(12, 10), 153, 1) << "one range for the sequence";
  InputImages images(sequence);
  EXPECT_EQ(cv::norm(frames[3].bgr, images.Read(3), cv::NORM_INF), 0.0);
  // All of the 16 bits: the upper 8 of them, as before.
  cv::Mat wide(48, 64, CV_16UC1, cv::Scalar(100 * 256));
  wide(cv::Rect(0, 0, 64, 8)).setTo(65535);
  wide(cv::Rect(0, 40, 64, 8)).setTo(0);
  for (int i = 0; i < 4; ++i) {
    cv::imwrite((folder_.Path() / fmt::format("{}.png", i)).string(), wide);
  }
  EXPECT_EQ(Play(OpenSequence({.path = folder_.Path(), .resize = "1"}))[0].gray.at<std::uint8_t>(20, 10),
            100);
}

TEST_F(Photographs, TurnToPixelsOfTheSensor) {
  WriteMixed();
  const Sequence sequence = OpenSequence({.path = folder_.Path(), .resize = "1"});
  const std::vector<Frame> frames = Play(sequence);
  ASSERT_EQ(frames.size(), 7U);
  InputImages images(sequence);
  for (const Frame& frame : frames) {
    EXPECT_EQ(BlockIn(frame.gray), cv::Rect(6, 10, 20, 8)) << frame.image_path;
    EXPECT_EQ(cv::norm(frame.bgr, images.Read(frame.index), cv::NORM_INF), 0.0) << frame.image_path;
  }
}

TEST_F(Photographs, StayUprightWhenMostArePortrait) {
  for (const char* name : {"0.jpg", "1.jpg", "3.jpg"}) {
    WritePhotograph(folder_, name, SensorPixels(), {.orientation = 6});
  }
  WritePhotograph(folder_, "2.jpg", SensorPixels(), {});
  for (const bool calibrated : {false, true}) {
    if (calibrated) {
      folder_.Write("camera.yaml", "width: 64\nheight: 48\nfx: 50\nfy: 51\ncx: 30\ncy: 20\n");
    }
    const Sequence sequence = OpenSequence({.path = folder_.Path(), .resize = "1"});
    EXPECT_EQ(sequence.camera.width, 48);
    EXPECT_EQ(sequence.camera.height, 64);
    for (const Frame& frame : Play(sequence)) {
      EXPECT_EQ(BlockIn(frame.gray), cv::Rect(30, 6, 8, 20)) << frame.image_path;
    }
    if (calibrated) {  // the calibration is of the sensor's pixels
      EXPECT_EQ(sequence.camera.fx, 51.0);
      EXPECT_EQ(sequence.camera.cx, 47.0 - 20.0);
      EXPECT_EQ(sequence.camera.cy, 30.0);
    }
  }
}

TEST_F(Photographs, KeepTheirBoxes) {
  WriteMixed();
  const Sequence listed = OpenSequence({.path = folder_.Path(), .resize = "1"});
  std::string pixels;
  for (std::size_t i = 0; i < listed.frames.size(); ++i) {
    const cv::Mat shown = cv::imread(listed.frames[i].image_path.string(), cv::IMREAD_GRAYSCALE);
    const cv::Rect block = BlockIn(shown);
    const std::string stem = listed.frames[i].image_path.stem().string();
    const double x = block.x + 0.5 * block.width, y = block.y + 0.5 * block.height;
    folder_.Write("labels/" + stem + ".txt",
                  "41 " + std::to_string(x / shown.cols) + " " + std::to_string(y / shown.rows) + " " +
                      std::to_string(static_cast<double>(block.width) / shown.cols) + " " +
                      std::to_string(static_cast<double>(block.height) / shown.rows) + " 0.9\n");
    pixels += std::to_string(listed.frames[i].timestamp) + " cup 0.9 " + std::to_string(block.x) + " " +
              std::to_string(block.y) + " " + std::to_string(block.width) + " " +
              std::to_string(block.height) + "\n";
  }
  for (const auto& boxes : {folder_.Path() / "labels", folder_.Write("pixels.txt", pixels)}) {
    for (const Frame& frame :
         Play(OpenSequence({.path = folder_.Path(), .detections = boxes, .resize = "0.5"}))) {
      ASSERT_EQ(frame.detections.size(), 1U) << boxes << frame.image_path;
      const Box2d& box = frame.detections[0].box;
      EXPECT_NEAR(box.x, 3.0, 1e-3) << boxes << frame.image_path;
      EXPECT_NEAR(box.y, 5.0, 1e-3) << boxes << frame.image_path;
      EXPECT_NEAR(box.width, 10.0, 1e-3) << boxes << frame.image_path;
      EXPECT_NEAR(box.height, 4.0, 1e-3) << boxes << frame.image_path;
      const Box2d in_file =
          InFilePixels(frame.detections, frame.bgr.size(), {64, 48}, frame.quarter_turns)[0].box;
      const cv::Rect shown = BlockIn(cv::imread(frame.image_path, cv::IMREAD_GRAYSCALE));
      EXPECT_NEAR(in_file.x, shown.x, 1e-3) << frame.image_path;
      EXPECT_NEAR(in_file.y, shown.y, 1e-3) << frame.image_path;
      EXPECT_NEAR(in_file.height, shown.height, 1e-3) << frame.image_path;
    }
  }
}

TEST_F(Photographs, KeepTheirMasks) {
  WriteMixed();
  for (const char* name : {"0.jpg", "1.jpg", "2.jpg", "3.png"}) {
    const cv::Mat shown = cv::imread((folder_.Path() / name).string(), cv::IMREAD_GRAYSCALE);
    std::filesystem::create_directories(folder_.Path() / "masks");
    cv::imwrite((folder_.Path() / "masks" / (std::string(name) + ".png")).string(), shown < 145);
  }
  const cv::Mat sensor_mask = 255 - SensorPixels();
  cv::imwrite((folder_.Path() / "masks" / "all.png").string(), sensor_mask > 100);
  for (const char* mask : {"masks", "masks/all.png"}) {
    for (const Frame& frame :
         Play(OpenSequence({.path = folder_.Path(), .resize = "1", .mask = folder_.Path() / mask}))) {
      if (!frame.ignored.empty()) {
        EXPECT_EQ(BlockIn(frame.ignored), cv::Rect(6, 10, 20, 8)) << mask << frame.image_path;
      }
    }
  }
}

TEST_F(Photographs, TakeMostFrequentSize) {
  cv::imwrite((folder_.Path() / "0-thumbnail.png").string(), cv::Mat(24, 32, CV_8UC3, cv::Scalar()));
  for (int i = 1; i < 5; ++i) {
    cv::imwrite((folder_.Path() / (std::to_string(i) + ".png")).string(), SensorPixels());
  }
  EXPECT_EQ(OpenSequence({.path = folder_.Path(), .resize = "1"}).camera.width, 64);
}

TEST_F(Photographs, TakeUsualSizes) {
  const std::vector<std::pair<cv::Size, cv::Size>> usual{{{1600, 1200}, {1280, 960}},
                                                         {{900, 1500}, {768, 1280}},
                                                         {{1280, 720}, {1280, 720}},
                                                         {{320, 240}, {480, 360}},
                                                         {{64, 48}, {128, 96}}};
  for (const auto& [size, mapped] : usual) {
    const auto file = folder_.Path() / "0.png";
    cv::imwrite(file.string(), cv::Mat(size, CV_8UC3, cv::Scalar::all(90)));
    const Sequence sequence = OpenSequence({.path = folder_.Path()});
    const cv::Size frame(sequence.camera.width, sequence.camera.height);
    EXPECT_EQ(frame, mapped);
    EXPECT_EQ(Play(sequence).at(0).bgr.size(), frame) << size;
    EXPECT_EQ(FileSize(sequence), size);
    const Camera in_file = InFilePixels(sequence.camera, sequence);
    const Camera full = OpenSequence({.path = folder_.Path(), .resize = "1"}).camera;
    EXPECT_EQ(cv::Size(full.width, full.height), size);
    EXPECT_NEAR(in_file.fx, full.fx, 1e-9) << size;
    EXPECT_NEAR(in_file.cy, full.cy, 1e-9) << size;
    EXPECT_EQ(FileSize(OpenSequence({.path = folder_.Path(), .known_camera = sequence.camera})), size);
  }
}

}  // namespace
}  // namespace sqslam
