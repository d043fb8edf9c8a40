#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>
#include <tuple>

#include "app/command_line/command.h"
#include "app/terminal/terminal.h"
#include "slam/io/result_files.h"
#include "slam/snapshot/recording.h"
#include "slam/util/error.h"
#include "tests/app/run_program.h"

namespace sqslam::testing {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// All commands, those of `figure` included, with the program itself as "".
const std::vector<std::string>& AllCommands() {
  static const std::vector<std::string> commands = {"",
                                                    "demo",
                                                    "run",
                                                    "detect",
                                                    "calibrate",
                                                    "info",
                                                    "eval",
                                                    "render",
                                                    "export",
                                                    "report",
                                                    "experiment",
                                                    "synth",
                                                    "fit",
                                                    "vocabulary",
                                                    "figure",
                                                    "figure shapes",
                                                    "figure maps",
                                                    "figure compare",
                                                    "figure trajectory",
                                                    "figure iou",
                                                    "figure timing",
                                                    "figure outliers",
                                                    "figure yaw"};
  return commands;
}

std::size_t LongestLine(const std::string& text) {
  std::istringstream lines(text);
  std::size_t longest = 0;
  for (std::string line; std::getline(lines, line);) {
    longest = std::max(longest, line.size());
  }
  return longest;
}

TEST(CommandLine, GroupsAndWrapsHelpWithExamples) {
  for (const std::string& command : AllCommands()) {
    const ProgramRun run = RunProgram(command + " --help");
    EXPECT_EQ(run.exit_code, 0);
    EXPECT_THAT(run.out, AllOf(HasSubstr("\nUsage: sqslam " + command), HasSubstr("\nGeneral:\n"),
                               HasSubstr("Examples:\n")))
        << command;
    EXPECT_LE(LongestLine(run.out), 80U) << run.out;
    EXPECT_EQ(RunProgram("help " + command).out, run.out);
  }
}

TEST(CommandLine, UsesSameShortNamesInAllCommands) {
  for (const std::string& command : AllCommands()) {
    std::istringstream lines(RunProgram(command + " --help").out);
    for (std::string line; std::getline(lines, line);) {
      EXPECT_FALSE(line.starts_with("  --output ") || line.starts_with("  --quiet ")) << command << line;
    }
  }
}

TEST(CommandLine, HelpListsAllChoices) {
  EXPECT_THAT(RunProgram("run --help").out,
              AllOf(HasSubstr("7-scenes"), HasSubstr("icl-nuim"), HasSubstr("iou+ttest"),
                    HasSubstr("ensemble"), HasSubstr("superquadric"), HasSubstr("quadric"),
                    HasSubstr("tum-freiburg2"), HasSubstr("centernet")));
  for (const std::string command : {"render", "figure maps"}) {
    EXPECT_THAT(RunProgram(command + " --help").out,
                AllOf(HasSubstr("blueprint"), HasSubstr("dark"), HasSubstr("minimal"), HasSubstr("paper")));
  }
}

TEST(CommandLine, PrintsHelpWithoutArguments) {
  const ProgramRun bare = RunProgram("");
  EXPECT_EQ(bare.exit_code, 0);
  EXPECT_EQ(bare.out, RunProgram("--help").out);
  EXPECT_EQ(bare.out, RunProgram("help").out);
  EXPECT_EQ(RunProgram("figure").out, RunProgram("figure --help").out);
}

TEST(CommandLine, FindsAssetsWhenStartedByPath) {
  const std::filesystem::path program = SQSLAM_PROGRAM;
  const TemporaryFolder folder;
  const std::string out = (folder.Path() / "out").string();
  const std::string command =
      "cd / && PATH=" + program.parent_path().string() + ":$PATH sqslam render --help >" + out;
  EXPECT_EQ(std::system(command.c_str()), 0);
  EXPECT_THAT(Slurp(out), HasSubstr("blueprint"));  // a file in configs/styles
}

TEST(CommandLine, VersionListsLibrariesAndBackEnds) {
  const ProgramRun run = RunProgram("--version");
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_THAT(run.out, AllOf(HasSubstr("sqslam "), HasSubstr("OpenCV"), HasSubstr("ONNX Runtime "),
                             HasSubstr("osmesa"), HasSubstr("egl")));
}

TEST(CommandLine, WrongUsageGivesOneLineAndCode2) {
  for (const std::string arguments : {"fly",
                                      "run",
                                      "run x --stride 0",
                                      "run x --frames none",
                                      "run x --no-such-option",
                                      "run x --format kiti",
                                      "run x --set tracking.min_inlier=30",
                                      "run x --set seed",
                                      "run x --config /nonexistent.yaml",
                                      "run 0 --camera-index 1",
                                      "run 0 --camera kinect-v2",
                                      "run 0 --camera kinect-v1 --deterministic",
                                      "info",
                                      "export x --output x.dwg",
                                      "export x --output x.gltf",
                                      "experiment",
                                      "experiment /nonexistent.yaml",
                                      "eval x --ground-truth y --output x.doc",
                                      "run x --output",
                                      "run x -o --quiet",
                                      "run x y",
                                      "run x --quiet=maybe",
                                      "info x --config --history",
                                      "fit x --clusters none",
                                      "eval x",
                                      "run x --frames 5:3",
                                      "run x --frames 0",
                                      "run x --start 2 --frames 5:9",
                                      "detect x --frames 3: --stride -1",
                                      "calibrate x --frames a:b -o y",
                                      "synth x -o y --frames 5:9",
                                      "demo --frames 1:",
                                      "help fly",
                                      "render x -o y.mp4 --frames 9:3",
                                      "detect x"}) {
    const ProgramRun run = RunProgram(arguments);
    EXPECT_EQ(run.exit_code, 2) << arguments << ": " << run.err;
    EXPECT_EQ(run.ErrorLines().size(), 1u) << run.err;
  }
}

TEST(CommandLine, SuggestsNearestName) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"rnu", "sqslam: unknown command 'rnu'; did you mean 'run'? (see sqslam --help)"},
      {"figure shape", "sqslam: unknown figure 'shape'; did you mean 'shapes'? (see sqslam figure --help)"},
      {"help rnu", "unknown command 'rnu'; did you mean 'run'?"},
      {"run --outptu x", "unknown option '--outptu'; did you mean '--output'? (see sqslam run --help)"},
      {"render --zoom 2", "did you mean '--camera-zoom-factor'?"},
      {"run --output", "--output: the value is missing, expected --output DIR (see sqslam run --help)"},
      {"eval", "sqslam: RESULT and --ground-truth are missing (see sqslam eval --help)"},
      {"run x --stride 0", "--stride 0: expected a whole number of at least 1"},
      {"run x --format tmu", "--format tmu: expected one of auto, tum"}};
  for (const auto& [arguments, message] : cases) {
    const ProgramRun run = RunProgram(arguments);
    EXPECT_EQ(run.exit_code, 2);
    EXPECT_THAT(run.ErrorLines(), ElementsAre(HasSubstr(message)));
  }
  EXPECT_THAT(RunProgram("run x --set tracking.min_inlier=30").err,
              HasSubstr("did you mean 'tracking.min_inliers'?"));
}

TEST(CommandLine, MissingInputGivesCode3) {
  for (const std::string arguments :
       {"run /nonexistent", "info /nonexistent", "export /nonexistent --output x.ply"}) {
    const ProgramRun run = RunProgram(arguments);
    EXPECT_EQ(run.exit_code, 3) << run.err;
    EXPECT_THAT(run.ErrorLines(), ElementsAre(HasSubstr("/nonexistent")));
  }
}

TEST(CommandLine, MissingLiveCameraGivesCode3) {
  const ProgramRun run = RunProgram("run 987 --camera kinect-v1");
  EXPECT_EQ(run.exit_code, 3) << run.err;
  EXPECT_THAT(run.ErrorLines(), ElementsAre(HasSubstr("camera 987: cannot be opened")));
}

TEST(CommandLine, SuggestsNearestCameraPreset) {
  EXPECT_THAT(RunProgram("run 0 --camera kinect-v2").err, HasSubstr("did you mean 'kinect-v1'?"));
}

TEST(CommandLine, ReadsDumpedConfigBackWithChanges) {
  const TemporaryFolder folder;
  const ProgramRun first =
      RunProgram("run --dump-config --set tracking.min_inliers=31 --seed 5 --association iou");
  EXPECT_EQ(first.exit_code, 0);
  EXPECT_THAT(first.out, AllOf(HasSubstr("min_inliers: 31"), HasSubstr("seed: 5"), HasSubstr("method: iou")));
  const auto config = folder.Write("my.yaml", first.out);
  EXPECT_EQ(RunProgram("run --dump-config --config " + config.string()).out, first.out);
}

// Command alone, without a program around it.
class CommandReader : public ::testing::Test {
 protected:
  CommandReader() {
    app::Command& draw = program_.AddCommand("draw", "Draw things");
    draw.Positional("MAP", maps_, "Maps").Required();
    draw.Group("Size");
    draw.Option("--zoom,-z X", zoom_, "Above 1: nearer").Range(-2.0, 10.0);
    draw.Option("--size W,H", size_, "A text that is long enough for a second line in a narrow terminal");
    draw.Option("--id N", ids_, "Ids").AtLeast(0);
    draw.Option("--join FILE...", joined_, "Pieces").Several();
    draw.Flag("--fast", fast_, "Faster");
    draw.OnRun([] { return 7; });
  }

  std::vector<std::string> maps_, joined_;
  std::optional<double> zoom_;
  std::string size_ = "3,4";
  std::vector<std::int64_t> ids_;
  bool fast_ = false;
  app::Command program_{"paint", "Paints"};
};

TEST_F(CommandReader, BindsValuesToVariables) {
  EXPECT_EQ(program_.Run({"draw", "a", "-z", "-1.5", "--id", "3", "--fast", "b", "--id=4",
                          "--size=", "--join", "x", "y"}),
            7);
  EXPECT_THAT(maps_, ElementsAre("a", "b"));
  EXPECT_THAT(ids_, ElementsAre(3, 4));
  EXPECT_THAT(joined_, ElementsAre("x", "y"));
  EXPECT_EQ(zoom_, -1.5);
  EXPECT_EQ(size_, "");
  EXPECT_TRUE(fast_);
}

TEST_F(CommandReader, RefusesInvalidValues) {
  for (const std::vector<std::string>& words : {std::vector<std::string>{"draw", "a", "--zoom", "11"},
                                                {"draw", "a", "--zoom", "near"},
                                                {"draw"},
                                                {"draw", "a", "--id", "-1"},
                                                {"draw", "a", "--id", "1.5"},
                                                {"draw", "a", "--size"},
                                                {"sketch"}}) {
    EXPECT_THROW(program_.Run(words), UsageError) << words.back();
  }
}

TEST_F(CommandReader, WrapsHelpToTerminalWidth) {
  const std::string narrow = program_.Commands().front().Help(50);
  const std::string wide = program_.Commands().front().Help(120);
  EXPECT_LE(LongestLine(narrow), 50U);
  EXPECT_THAT(
      wide,
      HasSubstr("  --size W,H                  A text that is long enough for a second line in a narrow "
                "terminal (default: 3,4)\n"));
  EXPECT_THAT(wide, HasSubstr("Usage: paint draw MAP... [OPTIONS]\n"));
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

TEST_F(MapCommands, InfoDescribesMapOrFolder) {
  const ProgramRun run = RunProgram("info " + map_.string());
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_THAT(run.out, AllOf(HasSubstr("/data/kitchen"), HasSubstr("teapot"), HasSubstr("snapshots  1")));
  EXPECT_THAT(RunProgram("info " + folder_.Path().string()).out, HasSubstr("teapot"));
  EXPECT_EQ(RunProgram("info --config " + map_.string()).out, "seed: 3\n");
}

TEST_F(MapCommands, InfoDescribesGrowthOfMap) {
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

TEST_F(MapCommands, ExportsByExtension) {
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

TEST(ShownCommandLine, HidesPasswords) {
  EXPECT_EQ(
      app::ShownCommandLine({"/opt/bin/sqslam", "run", "rtsp://me:secret@camera/main?key=1", "-o", "my run"}),
      "sqslam run rtsp://camera/main -o 'my run'");
}

}  // namespace
}  // namespace sqslam::testing
