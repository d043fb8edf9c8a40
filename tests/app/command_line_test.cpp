#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>
#include <tuple>

#include "slam/io/result_files.h"
#include "slam/snapshot/recording.h"
#include "tests/app/run_program.h"

namespace sqslam::testing {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(CommandLine, HelpOfEveryCommandShowsExamples) {
  for (const std::string command : {"", "run", "eval", "experiment", "info", "export", "vocabulary"}) {
    const ProgramRun run = RunProgram(command + " --help");
    EXPECT_EQ(run.exit_code, 0);
    EXPECT_THAT(run.out, HasSubstr("Examples:")) << command;
  }
}

TEST(CommandLine, VersionNamesLibrariesAndBackEnds) {
  const ProgramRun run = RunProgram("--version");
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_THAT(run.out,
              AllOf(HasSubstr("sqslam "), HasSubstr("OpenCV"), HasSubstr("osmesa"), HasSubstr("egl")));
}

TEST(CommandLine, WrongUsageIsOneLineAndCodeTwo) {
  for (const std::string arguments :
       {"", "fly", "run", "run x --stride 0", "run x --frames none", "run x --no-such-option",
        "run x --format kitti", "run x --set tracking.min_inlier=30", "run x --set seed",
        "run x --config /nonexistent.yaml", "run 0 --camera-index 1", "run 0 --camera kinect-v2",
        "run 0 --camera kinect-v1 --deterministic", "info", "export x --output x.dwg",
        "export x --output x.gltf", "experiment", "experiment /nonexistent.yaml",
        "eval x --ground-truth y --output x.doc"}) {
    const ProgramRun run = RunProgram(arguments);
    EXPECT_EQ(run.exit_code, 2) << arguments << ": " << run.err;
    EXPECT_EQ(run.ErrorLines().size(), 1u) << run.err;
  }
}

TEST(CommandLine, AMisspelledOptionIsAnsweredWithTheNearest) {
  EXPECT_THAT(RunProgram("run x --set tracking.min_inlier=30").err,
              HasSubstr("did you mean 'tracking.min_inliers'?"));
}

TEST(CommandLine, MissingInputIsCodeThree) {
  for (const std::string arguments :
       {"run /nonexistent", "info /nonexistent", "export /nonexistent --output x.ply"}) {
    const ProgramRun run = RunProgram(arguments);
    EXPECT_EQ(run.exit_code, 3) << run.err;
    EXPECT_THAT(run.ErrorLines(), ElementsAre(HasSubstr("/nonexistent")));
  }
}

TEST(CommandLine, ALiveCameraThatIsNotThereIsCodeThree) {
  const ProgramRun run = RunProgram("run 987 --camera kinect-v1");
  EXPECT_EQ(run.exit_code, 3) << run.err;
  EXPECT_THAT(run.ErrorLines(), ElementsAre(HasSubstr("camera 987: cannot be opened")));
}

TEST(CommandLine, AnUnknownCameraPresetIsAnsweredWithTheNearest) {
  EXPECT_THAT(RunProgram("run 0 --camera kinect-v2").err, HasSubstr("did you mean kinect-v1?"));
}

TEST(CommandLine, DumpedConfigCanBeReadBackWithChanges) {
  const TemporaryFolder folder;
  const ProgramRun first =
      RunProgram("run --dump-config --set tracking.min_inliers=31 --seed 5 --association iou");
  EXPECT_EQ(first.exit_code, 0);
  EXPECT_THAT(first.out, AllOf(HasSubstr("min_inliers: 31"), HasSubstr("seed: 5"), HasSubstr("method: iou")));
  const auto config = folder.Write("my.yaml", first.out);
  EXPECT_EQ(RunProgram("run --dump-config --config " + config.string()).out, first.out);
}

class MapCommands : public ::testing::Test {
 protected:
  MapCommands() : map_(folder_.Path() / "map.sqmap") {
    MapSnapshot snapshot;
    snapshot.frame_index = 42;
    snapshot.camera = {640, 480, 500.0, 500.0, 320.0, 240.0, {}, 30.0};
    snapshot.keyframes = {{0, 0, 1.5, {}}};
    snapshot.points = {{{1.0F, 2.0F, 3.0F}, {1, 2, 3}, 7}};
    snapshot.objects = {{7, "teapot", 0.5, 20, 1, 0.0, {}}};
    RecordingWriter writer(map_, {"/data/kitchen", "0", "seed: 3\n"});
    writer.Add(snapshot);
  }
  TemporaryFolder folder_;
  std::filesystem::path map_;
};

TEST_F(MapCommands, InfoTellsWhatIsInAMapOrInItsFolder) {
  const ProgramRun run = RunProgram("info " + map_.string());
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_THAT(run.out, AllOf(HasSubstr("/data/kitchen"), HasSubstr("teapot"), HasSubstr("snapshots  1")));
  EXPECT_THAT(RunProgram("info " + folder_.Path().string()).out, HasSubstr("teapot"));
  EXPECT_EQ(RunProgram("info --config " + map_.string()).out, "seed: 3\n");
}

TEST_F(MapCommands, InfoTellsHowTheMapGrew) {
  const ProgramRun run = RunProgram("info --history " + map_.string());
  EXPECT_EQ(run.exit_code, 0);
  std::istringstream lines(run.out);
  std::string header;
  std::getline(lines, header);
  int frame = 0;
  double time = 0.0;
  int keyframes = 0;
  int points = 0;
  int objects = 0;
  std::string tracking;
  lines >> frame >> time >> keyframes >> points >> objects >> tracking;
  EXPECT_THAT(header, HasSubstr("keyframes"));
  EXPECT_EQ(std::tuple(frame, keyframes, points, objects, tracking), std::tuple(42, 1, 1, 1, "no"));
}

TEST_F(MapCommands, ExportWritesByExtension) {
  const auto write = [&](const std::string& name) {
    const ProgramRun run =
        RunProgram("export " + map_.string() + " --output " + (folder_.Path() / name).string());
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return Slurp(folder_.Path() / name);
  };
  EXPECT_THAT(write("a.ply"), HasSubstr("element vertex 1\n"));
  EXPECT_THAT(write("a.txt"), HasSubstr("\n1.500000 0.0"));
  EXPECT_THAT(write("a.obj"), AllOf(HasSubstr("o teapot_7\n"), HasSubstr("\nf ")));
  write("a.json");
  EXPECT_EQ(ReadObjects(folder_.Path() / "a.json").at(0).label, "teapot");
}

}  // namespace
}  // namespace sqslam::testing
