#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "slam/detection/detection_check.h"
#include "slam/detection/detection_writer.h"
#include "slam/io/detections.h"

namespace sqslam {
namespace {
namespace fs = std::filesystem;

class DetectionFilesTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("sqslam-boxes-" + std::to_string(::getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  static Camera SmallCamera() {
    Camera camera;
    camera.width = 100;
    camera.height = 80;
    return camera;
  }

  fs::path folder_;
};

TEST_F(DetectionFilesTest, WhatIsWrittenIsReadBack) {
  DetectionWriter writer(folder_ / "boxes.txt", "a test");
  writer.Add(0.0, {{"cup", 0.5, {1, 2, 30, 40}}, {"book", 0.25, {5, 6, 7, 8}}});
  writer.Add(0.1, {});
  writer.Finish();
  EXPECT_FALSE(fs::exists(folder_ / "boxes.txt.part"));
  const auto frames = ReadDetections(folder_ / "boxes.txt", SmallCamera(), {0.0, 0.1});
  ASSERT_EQ(frames[0].size(), 2U);
  EXPECT_EQ(frames[0][1].label, "book");
  EXPECT_NEAR(frames[0][0].box.width, 30.0, 1e-9);
  EXPECT_TRUE(frames[1].empty());
}

TEST_F(DetectionFilesTest, AStoppedJobGoesOnAfterItsLastWholeFrame) {
  const fs::path part = folder_ / "boxes.txt.part";
  {
    DetectionWriter writer(folder_ / "boxes.txt", "a test");
    writer.Add(0.0, {{"cup", 0.5, {1, 2, 30, 40}}});
    writer.Add(0.1, {{"cup", 0.6, {1, 2, 30, 40}}});
  }
  std::ofstream(part, std::ios::app) << "0.200000 cup 0.7";  // killed within a line
  DetectionWriter writer(folder_ / "boxes.txt", "a test");
  EXPECT_EQ(writer.FramesDone(), 2);
  EXPECT_TRUE(writer.IsDone(0.1));
  EXPECT_FALSE(writer.IsDone(0.2));
  writer.Add(0.2, {{"cup", 0.8, {1, 2, 30, 40}}});
  writer.Finish();
  const auto frames = ReadDetections(folder_ / "boxes.txt", SmallCamera(), {0.0, 0.1, 0.2});
  ASSERT_EQ(frames[2].size(), 1U);
  EXPECT_EQ(frames[2][0].score, 0.8);
}

TEST_F(DetectionFilesTest, OtherSettingsBeginAnew) {
  { DetectionWriter(folder_ / "boxes.txt", "threshold 0.3").Add(0.0, {}); }
  EXPECT_EQ(DetectionWriter(folder_ / "boxes.txt", "threshold 0.4").FramesDone(), 0);
}

TEST_F(DetectionFilesTest, CheckNamesWhatIsOdd) {
  std::ofstream(folder_ / "boxes.txt") << "# boxes\n0.0 cup 0.9 1 2 30 40\n0.0 gizmo 0.9 1 2 30 40\n"
                                          "0.1 cup 0.9 80 2 30 40\n0.55 cup 0.9 1 2 30 40\n";
  const DetectionReport report = CheckDetections(folder_ / "boxes.txt", SmallCamera(), {0.0, 0.1, 0.2});
  EXPECT_EQ(report.boxes, 4);
  EXPECT_EQ(report.frames_with_boxes, 2);
  EXPECT_EQ(report.frames_without, (std::vector<double>{0.2}));
  EXPECT_EQ(report.unknown_labels, (std::map<std::string, int>{{"gizmo", 1}}));
  EXPECT_EQ(report.outside, (std::vector<int>{4}));
  EXPECT_EQ(report.no_frame, (std::vector<int>{5}));
  EXPECT_TRUE(report.HasErrors());
}

}  // namespace
}  // namespace sqslam
