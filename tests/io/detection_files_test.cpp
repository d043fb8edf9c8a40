#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "slam/io/detections.h"
#include "tests/io/temporary_folder.h"

namespace sqslam {
namespace {
namespace fs = std::filesystem;

using ::testing::HasSubstr;

const std::vector<cv::Size> kSmall = {{100, 80}};

class DetectionFilesTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("sqslam-boxes-" + std::to_string(::getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path folder_;
};

TEST_F(DetectionFilesTest, ReadsBackUnchanged) {
  DetectionWriter writer(folder_ / "boxes.txt", "a test");
  writer.Add(0.0, {{"cup", 0.5, {1, 2, 30, 40}}, {"book", 0.25, {5, 6, 7, 8}}});
  writer.Add(0.1, {});
  writer.Finish();
  EXPECT_FALSE(fs::exists(folder_ / "boxes.txt.part"));
  const auto frames = ReadDetections(folder_ / "boxes.txt", kSmall, {0.0, 0.1});
  ASSERT_EQ(frames[0].size(), 2U);
  EXPECT_EQ(frames[0][1].label, "book");
  EXPECT_NEAR(frames[0][0].box.width, 30.0, 1e-9);
  EXPECT_TRUE(frames[1].empty());
}

TEST_F(DetectionFilesTest, ResumesToSameFileWhenCutOffAtAnyByte) {
  const std::vector<std::vector<Detection>> boxes = {
      {{"cup", 0.5, {1, 2, 30, 40}}, {"book", 0.5, {3, 2, 30, 40}}}, {}, {{"cup", 0.75, {1, 2, 31, 40}}}};
  const fs::path file = folder_ / "boxes.txt";
  const fs::path part = folder_ / "boxes.txt.part";
  const auto read = [](const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
  };
  const auto go_on = [&](bool finish) {
    DetectionWriter writer(file, "a test");
    const int before = writer.Frames();
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      if (!writer.IsDone(0.1 * static_cast<double>(i))) {
        writer.Add(0.1 * static_cast<double>(i), boxes[i]);
      }
    }
    EXPECT_EQ(writer.Frames(), 3);
    EXPECT_EQ(writer.Boxes(), 3);
    if (finish) {
      writer.Finish();
    }
    return before;
  };
  go_on(false);
  const std::string whole_part = read(part);
  EXPECT_EQ(go_on(true), 3);
  const std::string whole = read(file);
  int most = 0;
  for (std::size_t size = 0; size < whole_part.size(); ++size) {
    std::ofstream(part, std::ios::binary) << whole_part.substr(0, size);
    most = std::max(most, go_on(true));
    ASSERT_EQ(read(file), whole) << "cut off after " << size << " bytes";
  }
  EXPECT_EQ(most, 2);  // whole frames are not done again
}

TEST_F(DetectionFilesTest, StartsOverWhenSettingsDiffer) {
  { DetectionWriter(folder_ / "boxes.txt", "threshold 0.3").Add(0.0, {}); }
  EXPECT_EQ(DetectionWriter(folder_ / "boxes.txt", "threshold 0.4").Frames(), 0);
  { DetectionWriter(folder_ / "boxes.txt", "threshold 0.3").Add(0.0, {}); }
  EXPECT_EQ(DetectionWriter(folder_ / "boxes.txt", "threshold 0.3").Frames(), 1);
}

TEST_F(DetectionFilesTest, RefusesSecondWriter) {
  const fs::path file = folder_ / "boxes.txt";
  DetectionWriter writer(file, "a test");
  writer.Add(0.0, {{"cup", 0.5, {1, 2, 30, 40}}});
  EXPECT_THAT(InputErrorOf([&] { DetectionWriter(file, "a test"); }),
              HasSubstr("boxes.txt.part: another program is writing this file"));
  writer.Add(0.1, {{"book", 0.5, {1, 2, 30, 40}}});
  writer.Finish();
  const auto frames = ReadDetections(file, kSmall, {0.0, 0.1});
  EXPECT_EQ(frames[0].size(), 1U);
  EXPECT_EQ(frames[1].size(), 1U);
}

TEST_F(DetectionFilesTest, RefusesPartChangedByAnotherProgram) {
  const fs::path file = folder_ / "boxes.txt";
  const fs::path part = folder_ / "boxes.txt.part";
  std::ofstream(file) << "earlier boxes";
  for (const bool removed : {true, false}) {
    DetectionWriter writer(file, "a test");
    writer.Add(0.0, {{"cup", 0.5, {1, 2, 30, 40}}});
    if (removed) {
      fs::remove(part);
    } else {
      fs::resize_file(part, 10);
    }
    EXPECT_THAT(InputErrorOf([&] { writer.Finish(); }), HasSubstr("boxes.txt.part: holds "));
    EXPECT_EQ(fs::file_size(file), 13U) << "the earlier boxes";
  }
}

TEST_F(DetectionFilesTest, KeepsBoxesInTheirFramesAcrossPause) {
  std::vector<double> times;  // two clips of ten seconds, ten minutes apart
  for (int i = 0; i < 600; ++i) {
    times.push_back(i / 30.0 + (i < 300 ? 0.0 : 600.0));
  }
  DetectionWriter writer(folder_ / "boxes.txt", "a test");
  for (const double time : times) {
    writer.Add(time, {{"cup", 0.5, {1, 2, 30, 40}}});
  }
  writer.Finish();
  const auto frames = ReadDetections(folder_ / "boxes.txt", kSmall, times);
  EXPECT_TRUE(std::ranges::all_of(frames, [](const auto& frame) { return frame.size() == 1; }));
}

TEST_F(DetectionFilesTest, AssignsBoxToNearestFrame) {
  std::ofstream(folder_ / "boxes.txt") << "1.0504 cup 0.9 1 2 30 40\n";
  const auto frames = ReadDetections(folder_ / "boxes.txt", kSmall, {0.0, 1.0, 1.05, 2.0, 3.0});
  EXPECT_TRUE(frames[1].empty());
  EXPECT_EQ(frames[2].size(), 1U);
}

TEST_F(DetectionFilesTest, ReportsUnusualBoxes) {
  std::ofstream(folder_ / "boxes.txt")
      << "# boxes\n0.0 cup 0.9 1 2 30 40\n0.0 gizmo 0.9 1 2 30 40\n"
         "0.1 cup 0.9 80 2 30 40\n0.55 cup 0.9 1 2 30 40\n0.1 cup 0.9 300 2 30 40\n";
  const auto [frames, report] = CheckDetections(folder_ / "boxes.txt", kSmall, {0.0, 0.1, 0.2});
  EXPECT_EQ(report.boxes, 5);
  EXPECT_EQ(frames[0].size(), 2U);
  EXPECT_EQ(frames[1].size(), 1U);
  EXPECT_TRUE(frames[2].empty());
  const std::string file = (folder_ / "boxes.txt").string();
  EXPECT_EQ(report.labels, (std::map<std::string, int>{{"cup", 4}, {"gizmo", 1}}));
  EXPECT_EQ(report.unknown_labels,
            (std::map<std::string, std::vector<std::string>>{{"gizmo", {file + ":3"}}}));
  EXPECT_EQ(report.clipped, (std::vector<std::string>{file + ":4"}));
  EXPECT_EQ(report.no_frame, (std::vector<std::string>{file + ":5"}));
  EXPECT_EQ(report.outside, (std::vector<std::string>{file + ":6"}));
  EXPECT_TRUE(report.HasErrors());
}

}  // namespace
}  // namespace sqslam
