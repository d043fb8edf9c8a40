#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

#include "slam/io/cameras.h"
#include "slam/io/result_files.h"
#include "slam/io/trajectory.h"
#include "slam/run/map_alignment.h"
#include "slam/snapshot/recording.h"
#include "tests/app/saved_map.h"

namespace sqslam::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// Expects the path of the second result to lie on that of the first, at the times of both.
void ExpectAligned(const fs::path& first, const fs::path& second) {
  const Sim3d S = AlignMaps(first, second);
  std::map<double, Eigen::Vector3d> at;
  for (const TimedPose& pose : ReadTrajectory(first / "trajectory.txt")) {
    at[pose.timestamp] = pose.T_map_camera.translation;
  }
  const double extent = (at.begin()->second - at.rbegin()->second).norm();
  int common = 0;
  for (const TimedPose& pose : ReadTrajectory(second / "trajectory.txt")) {
    if (const auto it = at.find(pose.timestamp); it != at.end()) {
      EXPECT_LT((S * pose.T_map_camera.translation - it->second).norm(), 0.03 * extent);
      ++common;
    }
  }
  EXPECT_GT(common, 20);
}

TEST_F(SavedMapCommands, LocalizesFramesInTheFrameOfTheMap) {
  const ProgramRun run =
      RunProgram("localize " + Input() + " --map " + Map() + " --frames 20: -o " + Out("found").string());
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr(" frames found in "));
  const Trajectory mapped = ReadTrajectory(fs::path(Map()) / "trajectory.txt");
  const Trajectory found = ReadTrajectory(Out("found") / "trajectory.txt");
  const RunStats stats = ReadStats(Out("found") / "stats.json");
  EXPECT_EQ(stats.frames, kWayFrames - 20);
  EXPECT_EQ(stats.tracked, static_cast<int>(found.size()));
  EXPECT_GE(stats.tracked, kWayMapped - 20);
  const double way =
      (mapped.back().T_map_camera.translation - mapped.front().T_map_camera.translation).norm();
  int compared = 0;
  for (const TimedPose& pose : found) {
    for (const TimedPose& known : mapped) {
      if (std::abs(known.timestamp - pose.timestamp) < 1e-3) {
        EXPECT_LT((known.T_map_camera.translation - pose.T_map_camera.translation).norm(), 0.02 * way);
        ++compared;
      }
    }
  }
  EXPECT_GE(compared, kWayMapped - 20);
  const RecordingReader drawn(Out("found") / "map.sqmap");
  const RecordingReader original(fs::path(Map()) / "map.sqmap");
  EXPECT_EQ(drawn.Last()->points.size(), original.Last()->points.size());
  EXPECT_FALSE(drawn.Last()->keyframes.empty());
  const ProgramRun render =
      RunProgram("render " + Out("found").string() + " --resolution 160,120 -o " + Out("found.png").string());
  EXPECT_EQ(render.exit_code, 0) << render.err;
}

TEST_F(SavedMapCommands, ExtendsOldMap) {
  const ProgramRun run = RunProgram("run " + Input() + " --extend " + Map() +
                                    " --frames 40: --no-render -o " + Out("both").string());
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const RunStats before = ReadStats(fs::path(Map()) / "stats.json");
  const RunStats after = ReadStats(Out("both") / "stats.json");
  EXPECT_EQ(after.frames, kWayFrames - 40);
  EXPECT_GE(after.keyframes, before.keyframes);
  EXPECT_GT(ReadTrajectory(Out("both") / "trajectory.txt").size(),
            ReadTrajectory(fs::path(Map()) / "trajectory.txt").size() + 30);
  const ProgramRun again =
      RunProgram("localize " + Input() + " --map " + Out("both").string() + " -o " + Out("again").string());
  EXPECT_EQ(again.exit_code, 0) << again.err;
  ExpectAligned(Map(), Out("both"));
}

TEST_F(SavedMapCommands, RejectsUnusableMapsInOneLine) {
  const std::string localize = "localize " + Input() + " --map ";
  ExpectRefused(localize + "nowhere", 3, "nowhere: does not exist");
  ExpectRefused(localize + Map() + " --set vocabulary=none", 2, "vocabulary=none");
  fs::create_directories(Out("cut"));
  std::ofstream(Out("cut") / "map.sqmap", std::ios::binary) << recording_.substr(0, recording_.size() / 2);
  ExpectRefused(localize + Out("cut").string(), 3, "map.sqmap: ");
  ExpectRefused("run " + Input() + " --extend " + Out("cut").string(), 3, "map.sqmap: ");
  const WrittenSequence other = TinySequence();
  other.Write("camera.yaml", "width: 320\nheight: 240\nfx: 600\nfy: 600\ncx: 160\ncy: 120\n");
  ExpectRefused("localize " + other.Path().string() + " --map " + Map(), 3, "differs from that of ");
  ExpectRefused("localize " + Input() + " --resize 0.5 --map " + Map(), 3, "--resize 480,360");
  const ProgramRun itself = RunProgram("run " + Input() + " --extend " + Map() + " -o " + Map());
  EXPECT_EQ(itself.exit_code, 3);
  EXPECT_THAT(itself.ErrorLines(), ElementsAre(HasSubstr("cannot be extended into itself")));
}

TEST_F(SavedMapCommands, ResizesImagesToThoseOfTheMap) {
  const std::string quick = " --no-render --deterministic --detector none ";
  const ProgramRun small =
      RunProgram("run " + Input() + quick + "--resize 0.75 --frames 40 -o " + Out("map-240").string());
  ASSERT_EQ(small.exit_code, 0) << small.err;
  const ProgramRun found = RunProgram("localize " + Input() + " --frames 20:30 --map " +
                                      Out("map-240").string() + " -o " + Out("found-240").string());
  EXPECT_EQ(found.exit_code, 0) << found.err;
  EXPECT_THAT(found.out, HasSubstr("10 of 10 frames found"));
  const ProgramRun extended = RunProgram("run " + Input() + quick + "--frames 20:60 --extend " +
                                         Out("map-240").string() + " -o " + Out("both-240").string());
  EXPECT_EQ(extended.exit_code, 0) << extended.err;
  EXPECT_EQ(ReadCamera(Out("both-240") / "camera.yaml").width, 320);
  EXPECT_EQ(ReadCamera(Out("both-240") / "sequence" / "camera.yaml").width, 320);
}

TEST_F(SavedMapCommands, MergesTwoMaps) {
  const ProgramRun run =
      RunProgram("run " + Input() + " --no-render --deterministic --detector none --frames 30: -o " +
                 Out("second").string());
  ASSERT_EQ(run.exit_code, 0) << run.err;
  ExpectAligned(Map(), Out("second"));
  const ProgramRun diff = RunProgram("diff " + Map() + " " + Out("second").string() + " --fail-on-change");
  EXPECT_EQ(diff.exit_code, 0) << diff.err;
  EXPECT_THAT(diff.out, HasSubstr("0 of 0 objects changed"));
  const ProgramRun merge = RunProgram("merge " + Map() + " " + Out("second").string() + " --no-render -o " +
                                      Out("merged").string());
  ASSERT_EQ(merge.exit_code, 0) << merge.err;
  EXPECT_THAT(merge.out, HasSubstr(" objects in one map"));
  EXPECT_EQ(ReadTrajectory(Out("merged") / "trajectory.txt").size(),
            ReadTrajectory(fs::path(Map()) / "trajectory.txt").size() +
                ReadTrajectory(Out("second") / "trajectory.txt").size());
  EXPECT_FALSE(fs::exists(Out("merged") / "submaps"));
  EXPECT_EQ(RecordingReader(Out("merged") / "map.sqmap").Size(), 1);
  const ProgramRun found = RunProgram("localize " + Input() + " --map " + Out("merged").string() + " -o " +
                                      Out("in-merged").string());
  EXPECT_EQ(found.exit_code, 0) << found.err;
  ExpectRefused("merge " + Map() + " nowhere", 3, "nowhere: does not exist");
}

}  // namespace
}  // namespace sqslam::testing
