#include "slam/io/sequence.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "slam/io/cameras.h"
#include "slam/io/detections.h"
#include "slam/io/trajectory.h"
#include "tests/io/captured_log.h"
#include "tests/io/temporary_folder.h"

namespace sqslam {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr const char* kCameraFile = "width: 64\nheight: 48\nfx: 50\nfy: 51\ncx: 32\ncy: 24\n";

TEST(CameraYaml, ReadsWhatItWrote) {
  const TemporaryFolder folder;
  Camera camera{640,   480, 522.119, 521.5, 315.819, 244.899, {-0.00355, -0.04611, 0.001, 0.0, 0.25},
                29.97, 26.5};
  WriteCamera(folder.Path() / "camera.yaml", camera);
  const Camera read = ReadCamera(folder.Path() / "camera.yaml");
  EXPECT_EQ(read.width, camera.width);
  EXPECT_EQ(read.height, camera.height);
  EXPECT_EQ(read.fx, camera.fx);
  EXPECT_EQ(read.fy, camera.fy);
  EXPECT_EQ(read.cx, camera.cx);
  EXPECT_EQ(read.cy, camera.cy);
  EXPECT_EQ(read.distortion, camera.distortion);
  EXPECT_EQ(read.fps, camera.fps);
  EXPECT_EQ(read.readout_ms, camera.readout_ms);
}

TEST(CameraYaml, ReadsFisheyeLenses) {
  const TemporaryFolder folder;
  const Camera camera{
      640, 480, 300.0, 301.0, 320.0, 240.0, {-0.01, 0.006, -0.004, 0.0008}, 20.0, 0.0, LensModel::kFisheye};
  WriteCamera(folder.Path() / "camera.yaml", camera);
  const Camera read = ReadCamera(folder.Path() / "camera.yaml");
  EXPECT_EQ(read.lens, LensModel::kFisheye);
  EXPECT_EQ(read.distortion, camera.distortion);
  const auto error_of = [&](const std::string& lines) {
    return InputErrorOf([&] { ReadCamera(folder.Write("a.yaml", kCameraFile + lines)); });
  };
  EXPECT_THAT(error_of("distortion_model: omni\n"),
              HasSubstr("a.yaml:7: distortion_model is omni, expected fisheye or radial-tangential"));
  EXPECT_THAT(error_of("distortion_model: fisheye\ndistortion: [1, 2, 3, 4, 5]\n"),
              HasSubstr("a.yaml:8: distortion of a fisheye lens is not a list of at most four numbers"));
}

TEST(CameraYaml, LimitsReadoutTime) {
  const TemporaryFolder folder;
  EXPECT_EQ(ReadCamera(folder.Write("a.yaml", kCameraFile)).readout_ms, 0.0);
  EXPECT_EQ(ReadCamera(folder.Write("b.yaml", std::string(kCameraFile) + "readout_ms: -20\n")).readout_ms,
            -20.0);
  EXPECT_THAT(InputErrorOf([&] {
                ReadCamera(folder.Write("c.yaml", std::string(kCameraFile) + "readout_ms: 2700\n"));
              }),
              HasSubstr("c.yaml:7: readout_ms is 2700, expected a number from -100 to 100"));
}

TEST(CameraYaml, ReportsBrokenFocalLengthsByLine) {
  const TemporaryFolder folder;
  for (const char* focal : {"0", ".nan", "nan", "-500", ".inf", "many", "[1]"}) {
    const auto path = folder.Write(
        "camera.yaml", std::string("width: 64\nheight: 48\nfx: ") + focal + "\nfy: 50\ncx: 32\ncy: 24\n");
    EXPECT_THAT(InputErrorOf([&] { ReadCamera(path); }),
                AllOf(HasSubstr("camera.yaml:3: fx is "), HasSubstr("expected a number")))
        << focal;
  }
}

TEST(CameraYaml, RefusesTooShortSides) {
  const TemporaryFolder folder;
  for (const char* side : {"0", "1", "15"}) {
    const auto path = folder.Write(
        "camera.yaml", std::string("width: 64\nheight: ") + side + "\nfx: 50\nfy: 50\ncx: 32\ncy: 1\n");
    EXPECT_THAT(InputErrorOf([&] { ReadCamera(path); }),
                AllOf(HasSubstr("camera.yaml:2: height is "), HasSubstr("a number from 16 to 16384")))
        << side;
  }
}

TEST(CameraYaml, ReportsMissingEntriesAndBrokenYaml) {
  const TemporaryFolder folder;
  EXPECT_THAT(InputErrorOf([&] { ReadCamera(folder.Write("a.yaml", "width: 64\n")); }),
              HasSubstr("height is missing"));
  EXPECT_THAT(InputErrorOf([&] { ReadCamera(folder.Write("b.yaml", "fx: [1\n")); }), HasSubstr("b.yaml:"));
  EXPECT_THAT(InputErrorOf([&] { ReadCamera(folder.Write("c.yaml", "")); }), HasSubstr("c.yaml:1"));
  EXPECT_THAT(InputErrorOf([&] { ReadCamera(folder.Path() / "none.yaml"); }), HasSubstr("No such file"));
  EXPECT_THAT(InputErrorOf([&] {
                ReadCamera(folder.Write("d.yaml", std::string(kCameraFile) + "distortion: [1, 2, x]\n"));
              }),
              HasSubstr("d.yaml:7: distortion[2] is x"));
}

TEST(Sequence, ListsFramesOfATumFolderWithItsBoxes) {
  const TemporaryFolder folder;
  folder.Write("camera.yaml", kCameraFile);
  folder.Write("rgb.txt", "# comment\r\n\r\n0.0 rgb/a b.png\r\n0.5\trgb/c.png\r\n");
  folder.Write("boxes.txt", "0.5 cup 0.9 1 2 10 12 7 0.5\n0.0 book 1 3 4 5 6\n");
  const Sequence sequence = OpenSequence({.path = folder.Path(), .resize = "1"});
  ASSERT_EQ(sequence.frames.size(), 2u);
  EXPECT_EQ(sequence.frames[0].image_path.filename(), "a b.png");
  EXPECT_EQ(sequence.frames[1].timestamp, 0.5);
  ASSERT_EQ(sequence.frames[1].detections.size(), 1u);
  EXPECT_EQ(sequence.frames[1].detections[0].label, "cup");
  EXPECT_EQ(sequence.frames[1].detections[0].box.height, 12.0);
  EXPECT_TRUE(sequence.has_detections);
}

// Images at 0, 0.1 and 0.2 s.
TEST(Sequence, ReadsListsOfOtherPrograms) {
  const TemporaryFolder folder;
  folder.Write("camera.yaml", std::string(kCameraFile) + "fps: 10\n");
  folder.Write("rgb/c.png", "");
  for (const char* text : {
           "0 rgb/a, b.png\n0.1 rgb/b.png\n0.2 rgb/c.png\n",
           "\xEF\xBB\xBFtimestamp,filename\r\n0,\"rgb/a, b.png\"\r\n0.1,rgb/b.png\r\n0.2,rgb/c.png\r\n",
           ",file,time\n0,\"rgb/a, b.png\",0\n1,rgb/b.png,0.1\n2,rgb/c.png,0.2\n",
           "0 rgb/a, b.png\n0 rgb/again.png\n0.1 rgb/b.png\n0.2 rgb/c.png 0.2 depth/c.png\n",
           "0 rgb/a, b.png\n100 rgb/b.png\n200 rgb/c.png\n",
           "0 rgb/a, b.png\n100000000 rgb/b.png\n200000000 rgb/c.png\n",
           "0 rgb/a, b.png\n1 rgb/b.png\n2 rgb/c.png\n",
       }) {
    folder.Write("rgb.txt", text);
    const Sequence sequence = OpenSequence({.path = folder.Path(), .resize = "1"});
    ASSERT_EQ(sequence.frames.size(), 3U) << text;
    EXPECT_EQ(sequence.frames[0].image_path, sequence.path / "rgb/a, b.png") << text;
    EXPECT_EQ(sequence.frames[2].image_path, sequence.path / "rgb/c.png") << text;
    EXPECT_NEAR(sequence.frames[1].timestamp, 0.1, 1e-9) << text;
    EXPECT_NEAR(sequence.frames[2].timestamp, 0.2, 1e-9) << text;
  }
}

TEST(Sequence, ReportsBrokenLinesByNumber) {
  const TemporaryFolder folder;
  folder.Write("camera.yaml", kCameraFile);
  const auto message = [&](const std::string& text) {
    folder.Write("rgb.txt", text);
    return InputErrorOf([&] { OpenSequence({.path = folder.Path()}); });
  };
  EXPECT_THAT(message("0.0 a.png\noops\n"), HasSubstr("rgb.txt:2: 'oops', expected 'timestamp path'"));
  EXPECT_THAT(message("0.0 a.png\nnan b.png\n"), HasSubstr("rgb.txt:2:"));
  EXPECT_THAT(message("0.2 a.png\n0.1 b.png\n"),
              HasSubstr("rgb.txt:2: '0.1 b.png', expected a timestamp after 0.2"));
  EXPECT_THAT(message("0.2 a.png\n0.1 b.png\n"), HasSubstr("rgb.txt:2:"));
  EXPECT_THAT(message("# nothing\n"), HasSubstr("lists no image"));
}

TEST(Sequence, TimesImageFolderByFrameRate) {
  const TemporaryFolder folder;
  folder.Write("b.png", "x");
  folder.Write("a.JPG", "x");
  folder.Write("notes.md", "x");
  const TemporaryFolder elsewhere;
  const auto camera = elsewhere.Write("c.yaml", std::string(kCameraFile) + "fps: 10\n");
  const Sequence sequence = OpenSequence({.path = folder.Path(), .camera = camera.string(), .resize = "1"});
  ASSERT_EQ(sequence.frames.size(), 2u);
  EXPECT_EQ(sequence.frames[0].image_path.filename(), "a.JPG");
  EXPECT_DOUBLE_EQ(sequence.frames[1].timestamp, 0.1);
  EXPECT_FALSE(sequence.has_detections);
}

TEST(Sequence, TakesFrameRateOfGuessedCameraFromTimestamps) {
  const TemporaryFolder folder;
  cv::imwrite((folder.Path() / "a.png").string(), cv::Mat(48, 64, CV_8UC3, cv::Scalar::all(7)));
  folder.Write("rgb.txt", "0.0 a.png\n0.2 a.png\n0.4 a.png\n1.9 a.png\n");
  EXPECT_NEAR(OpenSequence({.path = folder.Path(), .camera = "auto", .resize = "1"}).camera.fps, 5.0, 1e-9);
}

TEST(Sequence, GuessesMissingCalibrationOfOwnPicturesOnly) {
  const TemporaryFolder folder;
  folder.Write("a.png", "x");
  EXPECT_THAT(InputErrorOf([&] { OpenSequence({.path = folder.Path()}); }),
              HasSubstr("a.png: cannot be read"));
  cv::imwrite((folder.Path() / "a.png").string(), cv::Mat(48, 64, CV_8UC3, cv::Scalar::all(7)));
  const Sequence guessed = OpenSequence({.path = folder.Path(), .resize = "1"});
  EXPECT_EQ(guessed.camera.width, 64);
  EXPECT_FALSE(guessed.guessed_by.empty());
  folder.Write("rgb.txt", "0.0 a.png\n");
  EXPECT_THAT(InputErrorOf([&] { OpenSequence({.path = folder.Path()}); }), HasSubstr("--camera auto"));
}

TEST(Sequence, ReportsOtherFolders) {
  const TemporaryFolder folder;
  folder.Write("camera.yaml", kCameraFile);
  EXPECT_THAT(InputErrorOf([&] { OpenSequence({.path = folder.Path()}); }), HasSubstr("no image in it"));
  EXPECT_THAT(InputErrorOf([&] { OpenSequence({.path = folder.Path() / "none"}); }),
              HasSubstr("does not exist"));
  EXPECT_THAT(InputErrorOf([&] { OpenSequence({.path = folder.Write("film.mp4", "no film")}); }),
              HasSubstr("cannot be read as a video"));
}

class DetectionsTest : public ::testing::Test {
 protected:
  std::vector<std::vector<Detection>> Read(const std::string& text) {
    return ReadDetections(folder_.Write("boxes.txt", text), images_, {0.0, 0.033333, 0.066667});
  }
  TemporaryFolder folder_;
  const std::vector<cv::Size> images_ = {{64, 48}};
};

TEST_F(DetectionsTest, ClipsBoxesAndDropsThoseOutside) {
  const CapturedLog log;
  const auto frames = Read("0.0 cup 0.5 -10 -5 20 20\n0.0 cup 0.5 100 0 10 10\n0.0 cup 0.5 -30 0 10 10\n");
  ASSERT_EQ(frames[0].size(), 1u);
  const Box2d& box = frames[0][0].box;
  EXPECT_EQ(box.x, 0.0);
  EXPECT_EQ(box.y, 0.0);
  EXPECT_EQ(box.width, 10.0);
  EXPECT_EQ(box.height, 15.0);
  EXPECT_THAT(log.Text(), HasSubstr("boxes.txt:2: box outside the image, ignored (2 in all)"));
  EXPECT_THAT(log.Text(), HasSubstr("boxes.txt:1: box extends"));
}

TEST_F(DetectionsTest, WarnsOfBoxesOfMissingFrames) {
  const CapturedLog log;
  const auto frames = Read("0.0333 cup 0.5 1 1 10 10\n0.05 cup 0.5 1 1 10 10\n9 cup 0.5 1 1 10 10\n");
  EXPECT_EQ(frames[0].size() + frames[2].size(), 0u);
  EXPECT_EQ(frames[1].size(), 1u);
  EXPECT_THAT(log.Text(), HasSubstr("boxes.txt:2: box of a frame that does not exist"));
}

TEST_F(DetectionsTest, WarnsOnceOfUnknownLabel) {
  const CapturedLog log;
  const auto frames = Read("0 flurb 0.5 1 1 10 10\n0 flurb 0.5 2 1 10 10\n0 cereal_box 0.5 2 1 10 10\n");
  EXPECT_EQ(frames[0].size(), 3u);
  EXPECT_THAT(log.Text(), HasSubstr("boxes.txt:1: label 'flurb' is unknown"));
  EXPECT_EQ(log.Text().find("flurb"), log.Text().rfind("flurb"));
  EXPECT_EQ(log.Text().find("cereal_box"), std::string::npos);
}

TEST_F(DetectionsTest, ReportsBrokenLinesByNumber) {
  for (const char* line :
       {"0 cup 0.5 1 1 10", "0 cup 0.5 1 1 10 x", "0 cup 1.5 1 1 10 10", "0 cup 0.5 1 1 0 10",
        "nan cup 0.5 1 1 10 10", "0 cup 0.5 1 1 10 10 1 1 1", "0 cup 0.5 1 1 inf 10"}) {
    EXPECT_THAT(InputErrorOf([&] { Read(std::string("0 cup 1 1 1 9 9\n") + line + "\n"); }),
                HasSubstr("boxes.txt:2:"))
        << line;
  }
}

TEST_F(DetectionsTest, NamesCocoClassesInFolderOfFiles) {
  const CapturedLog log;
  folder_.Write("boxes/0.033333.txt", "41 1 2 10 12 0.75\n93 1 2 10 12 0.5\n");
  folder_.Write("boxes/5.0.txt", "41 1 2 10 12 0.75\n");
  const auto frames = ReadDetections(folder_.Path() / "boxes", images_, {0.0, 0.033333});
  ASSERT_EQ(frames[1].size(), 2u);
  EXPECT_EQ(frames[1][0].label, "cup");
  EXPECT_EQ(frames[1][0].score, 0.75);
  EXPECT_EQ(frames[1][1].label, "class_93");
  EXPECT_THAT(log.Text(), HasSubstr("'class_93' is unknown"));
  EXPECT_THAT(log.Text(), HasSubstr("5.0.txt:1: box of a frame that does not exist"));
  folder_.Write("boxes/0.0.txt", "cup 1 2 10 12 0.75\n");
  EXPECT_THAT(InputErrorOf([&] { ReadDetections(folder_.Path() / "boxes", images_, {0.0}); }),
              HasSubstr("0.0.txt:1:"));
}

}  // namespace
}  // namespace sqslam
