#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "tests/app/run_program.h"
#include "tests/app/written_sequence.h"
#include "tests/detection/hand_made_network.h"
#include "tests/support/textured_world.h"

namespace sqslam::testing {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

// Images of 128x64 with a coloured block each, and a network that takes colours for classes.
class DetectCommand : public ::testing::Test {
 protected:
  DetectCommand() {
    folder_.Write("network.onnx", HandMadeNetwork::ChannelsAsClasses());
    network_ = folder_
                   .Write("network.yaml",
                          "file: network.onnx\ndecoder: centernet\nwidth: 64\nheight: 32\nscale: 0.00392157\n"
                          "outputs: [heatmap, ltrb]\nclasses: [cup, book, apple]\nthreshold: 0.5\n")
                   .string();
    sequence_.List({0, 1, 2});
  }

  static std::vector<cv::Mat> Images() {
    std::vector<cv::Mat> images;
    for (const cv::Scalar& color : {cv::Scalar(230, 0, 0), cv::Scalar(0, 230, 0), cv::Scalar(0, 0, 230)}) {
      images.emplace_back(64, 128, CV_8UC3, cv::Scalar::all(0));
      cv::Mat(images.back(), cv::Rect(40, 24, 8, 8)).setTo(color);
    }
    return images;
  }

  static Camera SmallCamera() {
    Camera camera;
    camera.width = 128;
    camera.height = 64;
    camera.fx = camera.fy = 100.0;
    camera.cx = 64.0;
    camera.cy = 32.0;
    return camera;
  }

  ProgramRun Detect(const std::string& arguments) const {
    return RunProgram("detect " + sequence_.Path().string() + " --detector " + network_ + " --output " +
                      Boxes() + " " + arguments);
  }
  std::string Boxes() const { return (folder_.Path() / "boxes.txt").string(); }

  TemporaryFolder folder_;
  WrittenSequence sequence_{SmallCamera(), Images()};
  std::string network_;
};

TEST_F(DetectCommand, WritesOneBoxPerLine) {
  const ProgramRun run = Detect("");
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("3 boxes in 3 frames"));
  EXPECT_THAT(Slurp(Boxes()),
              AllOf(HasSubstr("0.000000 cup 0."), HasSubstr(" book 0."), HasSubstr(" apple 0."),
                    HasSubstr(" 24.0 8.0 32.0 32.0\n"), Not(HasSubstr("# end"))));
}

TEST_F(DetectCommand, NamesFetchScriptWithoutWeights) {
  const ProgramRun run =
      RunProgram("detect " + sequence_.Path().string() + " --set file=/no/such.onnx -o " + Boxes());
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.ErrorLines(), ElementsAre(HasSubstr("scripts/fetch-detector.sh")));
}

TEST_F(DetectCommand, AcceptsFramesAsNumberOrRange) {
  EXPECT_THAT(Detect("--frames 2").out, HasSubstr("2 boxes in 2 frames"));
  std::filesystem::remove(Boxes());
  EXPECT_THAT(Detect("--frames 1:2").out, HasSubstr("1 boxes in 1 frames"));
}

TEST_F(DetectCommand, ResumesWhereItWasStopped) {
  ASSERT_EQ(Detect("").exit_code, 0);
  const std::string whole = Slurp(Boxes());
  const std::size_t first_box = whole.find("0.000000");
  const std::string first_line = whole.substr(first_box, whole.find('\n', first_box) + 1 - first_box);
  folder_.Write("boxes.txt.part", whole.substr(0, first_box) + first_line + "# end 0.000000\n0.0333");
  const ProgramRun run = Detect("");
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_THAT(run.err, HasSubstr("1 frames are done already"));
  EXPECT_THAT(run.out, HasSubstr("3 boxes in 3 frames"));
  EXPECT_EQ(Slurp(Boxes()), whole);
  // Boxes that were made with another threshold are not those that are asked for now.
  folder_.Write("boxes.txt.part", whole.substr(0, first_box) + first_line + "# end 0.000000\n");
  EXPECT_THAT(Detect("--set threshold=0.95").out, HasSubstr("0 boxes in 3 frames"));
}

// By SIGTERM, which ends it in the same way: a shell has its background jobs ignore Ctrl-C.
TEST_F(DetectCommand, KeepsFinishedFramesOnCtrlC) {
  std::vector<int> images(50'000, 0);  // much more than a second's work
  sequence_.List(images);
  const std::string command = fmt::format(
      "{} detect {} --detector {} --output {} --quiet 2>{}/err & job=$!; "
      "until grep -qs 'end 0.033333' {}.part; do sleep 0.05; done; kill -TERM $job; wait $job",
      SQSLAM_PROGRAM, sequence_.Path().string(), network_, Boxes(), folder_.Path().string(), Boxes());
  const int status = std::system(command.c_str());
  EXPECT_EQ(WEXITSTATUS(status), 130);
  EXPECT_THAT(Slurp(folder_.Path() / "err"), HasSubstr("run the same command to resume"));
  EXPECT_FALSE(std::filesystem::exists(Boxes()));
  EXPECT_THAT(Slurp(Boxes() + ".part"), HasSubstr("# end 0.033333\n"));
}

TEST_F(DetectCommand, NamesInvalidNetworkSettings) {
  EXPECT_EQ(Detect("--set width=33").exit_code, 2);
  EXPECT_EQ(Detect("--set treshold=0.4").exit_code, 2);
  for (const auto& [setting, expected] :
       {std::pair("classes=[a,b]", "1x3x8x16"), std::pair("outputs=[boxes,ltrb]", "[heatmap, ltrb]"),
        std::pair("file=missing.onnx", "missing.onnx")}) {
    const ProgramRun run = Detect(fmt::format("--set '{}'", setting));
    EXPECT_EQ(run.exit_code, 3) << setting;
    ASSERT_EQ(run.ErrorLines().size(), 1U) << run.err;
    EXPECT_THAT(run.ErrorLines()[0], HasSubstr(expected));
  }
}

TEST_F(DetectCommand, ChecksOnlyRequestedFrames) {
  ASSERT_EQ(Detect("").exit_code, 0);
  const auto check = [&](const std::string& arguments) {
    return RunProgram("detect " + sequence_.Path().string() + " --check " + Boxes() + " " + arguments);
  };
  EXPECT_EQ(check("").exit_code, 0);
  EXPECT_THAT(check("").out, HasSubstr("3 boxes; 3 of 3 frames have some"));
  folder_.Write("boxes.txt", "0.0 cup 0.9 1 2 30 20\n0.0 gizmo 0.9 100 2 60 20\n9.0 cup 0.9 1 2 30 20\n");
  const ProgramRun odd = check("--start 1");
  EXPECT_EQ(odd.exit_code, 3);
  EXPECT_THAT(odd.out, AllOf(HasSubstr("0 of 2 frames have some"), HasSubstr("gizmo"),
                             HasSubstr("boxes.txt:2"), HasSubstr("boxes.txt:3")));
}

// A run that finds its boxes itself, in a world whose colours the network takes for things.
TEST_F(DetectCommand, SuppliesBoxesDuringRun) {
  const WrittenSequence world(HandHeldPath(60));
  const auto run = [&](const std::string& output, const std::string& arguments) {
    return RunProgram(fmt::format("run {} --detector {} --no-render --output {} {}", world.Path().string(),
                                  network_, (folder_.Path() / output).string(), arguments));
  };
  const ProgramRun first = run("first", "--deterministic");
  ASSERT_EQ(first.exit_code, 0) << first.err;
  EXPECT_THAT(first.err, HasSubstr("boxes by network.onnx"));
  EXPECT_THAT(Slurp(folder_.Path() / "first/stats.json"), HasSubstr("\"detection\""));
  ASSERT_EQ(run("second", "--deterministic").exit_code, 0);
  for (const char* file : {"boxes.txt", "objects.json", "trajectory.txt"}) {
    EXPECT_EQ(Slurp(folder_.Path() / "first" / file), Slurp(folder_.Path() / "second" / file)) << file;
  }
  const std::string boxes = Slurp(folder_.Path() / "first/boxes.txt");
  EXPECT_GT(std::count(boxes.begin(), boxes.end(), '\n'), 60);
  // Threads run as they may: the network sees the same frames.
  const ProgramRun third = run("third", "");
  EXPECT_EQ(third.exit_code, 0);
  EXPECT_EQ(Slurp(folder_.Path() / "third/boxes.txt"), boxes);
  EXPECT_THAT(third.out, HasSubstr("detector saw 21 of 60 frames"));
  EXPECT_THAT(Slurp(folder_.Path() / "third/stats.json"), HasSubstr("\"detector_frames\": 21"));
}

TEST_F(DetectCommand, LeavesNoResultWhenNetworkOfRunIsUnusable) {
  folder_.Write("network.onnx", "not a network");
  const std::filesystem::path output = folder_.Path() / "result";
  const ProgramRun run = RunProgram(
      fmt::format("run {} --detector {} --output {}", sequence_.Path().string(), network_, output.string()));
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.ErrorLines(), ElementsAre(HasSubstr("network.onnx")));
  EXPECT_FALSE(std::filesystem::exists(output));
  EXPECT_EQ(
      RunProgram(fmt::format("run {} --detector {} --detections x.txt", sequence_.Path().string(), network_))
          .exit_code,
      2);
}

}  // namespace
}  // namespace sqslam::testing
