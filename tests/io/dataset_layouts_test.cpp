#include "slam/io/dataset_layouts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "slam/io/image_files.h"
#include "slam/io/sequence.h"
#include "tests/io/captured_log.h"
#include "tests/io/temporary_folder.h"

namespace sqslam {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr double kFps = 30.0;

std::vector<std::string> Names(const Sequence& sequence) {
  std::vector<std::string> names;
  for (const SequenceFrame& frame : sequence.frames) {
    names.push_back(frame.image_path.lexically_relative(sequence.path).string());
  }
  return names;
}

TEST(NumericLess, CountsRunsOfDigitsAsNumbers) {
  EXPECT_TRUE(NumericLess("2.png", "10.png"));
  EXPECT_FALSE(NumericLess("10.png", "2.png"));
  EXPECT_TRUE(NumericLess("a9b2", "a9b10"));
  EXPECT_TRUE(NumericLess("a.png", "b.png"));
  EXPECT_TRUE(NumericLess("a", "a1"));
  EXPECT_FALSE(NumericLess("7", "7"));
  EXPECT_TRUE(NumericLess("99999999999999999999998.png", "99999999999999999999999.png"));
  EXPECT_NE(NumericLess("01.png", "1.png"), NumericLess("1.png", "01.png"));  // a total order
}

TEST(ImageFiles, DepthImagesAreToldByTheirNames) {
  for (const char* name : {"00000-depth.png", "frame-000000.depth.png", "7_depth.PNG", "x-DEPTH.tif"}) {
    EXPECT_TRUE(IsDepthImage(name)) << name;
  }
  for (const char* name : {"00000-color.png", "depth.png", "depths-1.png", "in-depth-1.png"}) {
    EXPECT_FALSE(IsDepthImage(name)) << name;
  }
  EXPECT_EQ(LastNumber("scene_00_0012.png"), 12);
  EXPECT_EQ(LastNumber("frame-000123.color.png"), 123);
  EXPECT_EQ(LastNumber("no.png"), std::nullopt);
  EXPECT_EQ(LastNumber("99999999999999999999.png"), std::nullopt);
}

TEST(DatasetLayouts, IclNuimFollowsItsAssociations) {
  const TemporaryFolder folder;
  const CapturedLog log;
  folder.Write("associations.txt",
               "1 depth/1.png 1 rgb/1.png\n2 depth/2.png 2 rgb/2.png\n10 depth/10.png 10 rgb/10.png\n");
  folder.Write("rgb/1.png", "");
  folder.Write("livingRoom2.gt.freiburg", "");
  const Sequence sequence = OpenSequence({.path = folder.Path()});
  EXPECT_EQ(sequence.format, SequenceFormat::kIclNuim);
  EXPECT_THAT(Names(sequence), ElementsAre("rgb/1.png", "rgb/2.png", "rgb/10.png"));
  EXPECT_DOUBLE_EQ(sequence.frames[2].timestamp, 10 / kFps);
  EXPECT_EQ(sequence.camera.fx, 481.20);
  EXPECT_EQ(sequence.camera.fy, 480.0);
  EXPECT_THAT(log.Text(), HasSubstr("icl-nuim layout without camera.yaml, taken with --camera icl-nuim"));
}

TEST(DatasetLayouts, IclNuimAssociationsMayNameTheColourImageFirst) {
  const TemporaryFolder folder;
  folder.Write("associations.txt", "3 rgb/3.png 4 depth/4.png\n");
  folder.Write("rgb/3.png", "");
  const Sequence sequence = OpenSequence({.path = folder.Path()});
  EXPECT_THAT(Names(sequence), ElementsAre("rgb/3.png"));
  EXPECT_DOUBLE_EQ(sequence.frames[0].timestamp, 3 / kFps);
  folder.Write("associations.txt", "3 rgb/3.png 4 depth/4.png\n5 rgb/5.png\n");
  EXPECT_THAT(InputErrorOf([&] { OpenSequence({.path = folder.Path()}); }),
              HasSubstr("associations.txt:2: '5 rgb/5.png', expected"));
  folder.Write("associations.txt", "3 rgb/3.png 4 depth/4.png\nx rgb/5.png 5 depth/5.png\n");
  EXPECT_THAT(InputErrorOf([&] { OpenSequence({.path = folder.Path()}); }), HasSubstr("associations.txt:2:"));
}

TEST(DatasetLayouts, IclNuimWithoutAssociationsSortsItsNumbers) {
  const TemporaryFolder folder;
  folder.Write("traj0.gt.freiburg", "");
  for (const char* name : {"rgb/10.png", "rgb/0.png", "rgb/2.png", "depth/0.png", "rgb/notes.txt"}) {
    folder.Write(name, "");
  }
  const Sequence sequence = OpenSequence({.path = folder.Path()});
  EXPECT_THAT(Names(sequence), ElementsAre("rgb/0.png", "rgb/2.png", "rgb/10.png"));
  EXPECT_DOUBLE_EQ(sequence.frames[1].timestamp, 2 / kFps);  // image 1 is missing: a gap, no shift
}

TEST(DatasetLayouts, IclNuimAsRendered) {
  const TemporaryFolder folder;
  for (const char* name :
       {"scene_00_0001.png", "scene_00_0000.png", "scene_00_0000.depth", "scene_00_0000.txt"}) {
    folder.Write(name, "");
  }
  const Sequence sequence = OpenSequence({.path = folder.Path()});
  EXPECT_EQ(sequence.format, SequenceFormat::kIclNuim);
  EXPECT_THAT(Names(sequence), ElementsAre("scene_00_0000.png", "scene_00_0001.png"));
}

TEST(DatasetLayouts, ScenesV2TakesTheColourImages) {
  const TemporaryFolder folder;
  for (const char* name : {"00001-color.png", "00001-depth.png", "00000-color.png", "00000-depth.png"}) {
    folder.Write(name, "");
  }
  const Sequence sequence = OpenSequence({.path = folder.Path()});
  EXPECT_EQ(sequence.format, SequenceFormat::kScenesV2);
  EXPECT_THAT(Names(sequence), ElementsAre("00000-color.png", "00001-color.png"));
  EXPECT_DOUBLE_EQ(sequence.frames[1].timestamp, 1 / kFps);
  EXPECT_EQ(sequence.camera.fx, 570.3);
}

TEST(DatasetLayouts, SevenScenesTakesTheColourImages) {
  const TemporaryFolder folder;
  for (const char* name : {"frame-000010.color.png", "frame-000010.depth.png", "frame-000010.pose.txt",
                           "frame-000009.color.png"}) {
    folder.Write(name, "");
  }
  const Sequence sequence = OpenSequence({.path = folder.Path()});
  EXPECT_EQ(sequence.format, SequenceFormat::k7Scenes);
  EXPECT_THAT(Names(sequence), ElementsAre("frame-000009.color.png", "frame-000010.color.png"));
  EXPECT_DOUBLE_EQ(sequence.frames[0].timestamp, 9 / kFps);
  EXPECT_EQ(sequence.camera.fx, 525.0);
}

TEST(DatasetLayouts, ACameraOfTheFolderGoesBeforeThePreset) {
  const TemporaryFolder folder;
  const CapturedLog log;
  folder.Write("frame-000000.color.png", "");
  folder.Write("camera.yaml", "width: 64\nheight: 48\nfx: 50\nfy: 51\ncx: 32\ncy: 24\nfps: 10\n");
  EXPECT_EQ(OpenSequence({.path = folder.Path()}).camera.fx, 50.0);
  EXPECT_EQ(log.Text(), "");
  EXPECT_EQ(OpenSequence({.path = folder.Path(), .camera = "kinect-v1"}).camera.cx, 319.5);
}

TEST(DatasetLayouts, TumFoldersAreToldByTheirNames) {
  const TemporaryFolder folder;
  folder.Write("rgbd_dataset_freiburg2_desk/rgb.txt", "0.0 rgb/a.png\n");
  folder.Write("office/rgb.txt", "0.0 rgb/a.png\n");
  EXPECT_EQ(OpenSequence({.path = folder.Path() / "rgbd_dataset_freiburg2_desk"}).camera.fx, 520.9);
  EXPECT_EQ(PresetOf(SequenceFormat::kTum, folder.Path() / "rgbd_dataset_freiburg3_x" / ""), "tum-freiburg3");
  EXPECT_THAT(InputErrorOf([&] { OpenSequence({.path = folder.Path() / "office"}); }),
              AllOf(HasSubstr("camera.yaml: does not exist"), HasSubstr("--camera PRESET (7-scenes, ")));
}

TEST(DatasetLayouts, PlainFoldersSortNumericallyAndLeaveDepthOut) {
  const TemporaryFolder folder;
  folder.Write("camera.yaml", "width: 64\nheight: 48\nfx: 50\nfy: 51\ncx: 32\ncy: 24\nfps: 10\n");
  for (const char* name : {"10.png", "2.png", "1.png", "1_depth.png", "2-depth.png"}) {
    folder.Write(name, "");
  }
  const Sequence sequence = OpenSequence({.path = folder.Path()});
  EXPECT_EQ(sequence.format, SequenceFormat::kImages);
  EXPECT_THAT(Names(sequence), ElementsAre("1.png", "2.png", "10.png"));
}

TEST(DatasetLayouts, AFormatThatDoesNotFitSaysWhatItExpects) {
  const TemporaryFolder folder;
  folder.Write("a.png", "");
  EXPECT_THAT(
      InputErrorOf([&] { OpenSequence({.path = folder.Path(), .format = SequenceFormat::k7Scenes}); }),
      HasSubstr("no image of the 7-scenes layout in it, expected names like frame-000000.color.png"));
  folder.Write("1-color.png", "");
  folder.Write("01-color.png", "");
  EXPECT_THAT(
      InputErrorOf([&] { OpenSequence({.path = folder.Path(), .format = SequenceFormat::kScenesV2}); }),
      HasSubstr("expected rising frame numbers"));
}

TEST(DatasetLayouts, TheFolderAboveASequenceHintsAtIt) {
  const TemporaryFolder folder;
  folder.Write("camera.yaml", "width: 64\nheight: 48\nfx: 50\nfy: 51\ncx: 32\ncy: 24\n");
  folder.Write("seq-02/frame-000000.color.png", "");
  folder.Write("seq-01/frame-000000.color.png", "");
  EXPECT_THAT(InputErrorOf([&] { OpenSequence({.path = folder.Path()}); }),
              AllOf(HasSubstr("no image in it"), HasSubstr("did you mean"), HasSubstr("seq-01?")));
}

}  // namespace
}  // namespace sqslam
