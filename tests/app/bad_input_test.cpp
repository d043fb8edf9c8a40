#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <opencv2/imgcodecs.hpp>
#include <thread>

#include "slam/io/result_files.h"
#include "slam/io/trajectory.h"
#include "slam/snapshot/recording.h"
#include "slam/snapshot/saved_map.h"
#include "slam/util/atomic_file.h"
#include "tests/app/run_program.h"
#include "tests/app/written_sequence.h"
#include "tests/support/textured_world.h"

namespace sqslam::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr int kPathFrames = 70;

class BadInput : public ::testing::Test {
 protected:
  ProgramRun Run(const WrittenSequence& sequence, const std::string& options = "",
                 const std::string& before = "") {
    return RunProgram("run " + sequence.Path().string() +
                          " --no-render --deterministic --detector none --output " + Output().string() + " " +
                          options,
                      before);
  }
  void ExpectRefused(const WrittenSequence& sequence, int exit_code, const std::string& message,
                     const std::string& options = "") {
    const ProgramRun run = Run(sequence, options);
    EXPECT_EQ(run.exit_code, exit_code) << run.err;
    EXPECT_THAT(run.ErrorLines(), ElementsAre(HasSubstr(message)));
    EXPECT_FALSE(fs::exists(Output()));  // refused before anything is made
  }
  fs::path Output() const { return folder_.Path() / "result"; }

  TemporaryFolder folder_;
};

TEST_F(BadInput, NamesBrokenLinesOfTheImageList) {
  const WrittenSequence sequence = TinySequence();
  sequence.Write("rgb.txt", "0.0 rgb/0000.jpg\nhello\n");
  ExpectRefused(sequence, 3, "rgb.txt:2: 'hello', expected 'timestamp path'");
  sequence.Write("rgb.txt", "0.1 rgb/0000.jpg\n0.0 rgb/0001.jpg\n");
  ExpectRefused(sequence, 3, "rgb.txt:2: '0.0 rgb/0001.jpg', expected a timestamp after 0.1");
}

TEST_F(BadInput, RejectsLearningOfDistortionInRuns) {
  ExpectRefused(TinySequence(), 2, "mapping.camera.what=focal+radial",
                "--set mapping.camera.what=focal+radial");
}

TEST_F(BadInput, RejectsEmptySequence) {
  const WrittenSequence sequence = TinySequence();
  sequence.Write("rgb.txt", "# no image\n");
  ExpectRefused(sequence, 3, "rgb.txt: lists no image");
}

TEST_F(BadInput, RejectsBrokenCalibration) {
  const WrittenSequence sequence = TinySequence();
  const std::string rest = "fy: 500\ncx: 320\ncy: 240\n";
  for (const std::string focal : {".nan", "0", "-500"}) {
    sequence.Write("camera.yaml", "width: 640\nheight: 480\nfx: " + focal + "\n" + rest);
    ExpectRefused(sequence, 3, "camera.yaml:3: fx is " + focal + ", expected a number from");
  }
  sequence.Write("camera.yaml", "width: 640\nheight 480\nfx: 500\n");
  ExpectRefused(sequence, 3, "camera.yaml:");
  fs::remove(sequence.Path() / "camera.yaml");
  ExpectRefused(sequence, 3, "camera.yaml: does not exist");
}

TEST_F(BadInput, NamesBrokenBoxLines) {
  const WrittenSequence sequence = TinySequence();
  sequence.Write("boxes.txt", "0.0 cup 0.9 10 10 20 20\n0.0 cup 0.9 10 10 twenty 20\n");
  ExpectRefused(sequence, 3, "boxes.txt:2: ");
  sequence.Write("boxes/0.0.txt", "41 10 10 20\n");
  ExpectRefused(sequence, 3, "0.0.txt:1: ", "--detections " + (sequence.Path() / "boxes").string());
  ExpectRefused(sequence, 3, "nowhere: does not exist", "--detections nowhere");
}

TEST_F(BadInput, WarnsOfBoxesThatMatchNoFrame) {
  const WrittenSequence sequence = TinySequence();
  sequence.Write("boxes.txt",
                 "0.0 cup 0.9 900 10 20 20\n7.0 cup 0.9 10 10 20 20\n0.0 flurb 0.9 10 10 20 20\n");
  const ProgramRun run = Run(sequence);
  EXPECT_EQ(run.exit_code, 4);  // two frames make no map
  EXPECT_THAT(run.err, HasSubstr("boxes.txt:1: box outside the image"));
  EXPECT_THAT(run.err, HasSubstr("boxes.txt:2: box of a frame that does not exist"));
  EXPECT_THAT(run.err, HasSubstr("boxes.txt:3: label 'flurb' is unknown"));
}

TEST_F(BadInput, RejectsNonEmptyOutputFolder) {
  const WrittenSequence sequence = TinySequence();
  folder_.Write("result/trajectory.txt", "precious");
  const ProgramRun run = Run(sequence);
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.ErrorLines(),
              ElementsAre(HasSubstr("result: exists already, expected a new or empty folder")));
  EXPECT_EQ(Slurp(Output() / "trajectory.txt"), "precious");
  EXPECT_FALSE(fs::exists(Output() / "map.sqmap"));
}

TEST_F(BadInput, RejectsSequenceWithoutUsableImage) {
  const WrittenSequence sequence = TinySequence();
  for (int i = 0; i < 2; ++i) {
    cv::imwrite(sequence.Image(i).string(), cv::Mat(24, 36, CV_8UC3, cv::Scalar()));
  }
  const ProgramRun other_size = Run(sequence);
  EXPECT_EQ(other_size.exit_code, 3);
  EXPECT_THAT(other_size.ErrorLines(), ElementsAre(HasSubstr("is 36x24, expected the camera's 320x240")));
  for (int i = 0; i < 2; ++i) {
    WriteFileAtomically(sequence.Image(i), "no image");
  }
  const ProgramRun run = Run(sequence);
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.ErrorLines(), ElementsAre(HasSubstr("none of the 2 images could be used")));
}

TEST_F(BadInput, NamesUnusableImagesWhenTheRestGivesNoMap) {
  const WrittenSequence sequence = TinySequence();
  WriteFileAtomically(sequence.Image(1), "no image");
  const ProgramRun run = Run(sequence);
  EXPECT_EQ(run.exit_code, 4);
  EXPECT_THAT(run.ErrorLines(), ElementsAre(HasSubstr("no map: 1 of 2 images cannot be used")));
}

TEST_F(BadInput, SkipsBadFramesAndMapsTheRest) {
  const WrittenSequence sequence(HandHeldPath(kPathFrames));
  fs::remove(sequence.Image(40));
  sequence.Write("rgb/0045.jpg", "this is no image");
  cv::imwrite(sequence.Image(50).string(), cv::Mat(24, 32, CV_8UC3, cv::Scalar()));
  const ProgramRun run = Run(sequence);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, HasSubstr("frame 40 skipped: " + sequence.Image(40).string() + " cannot be opened"));
  EXPECT_THAT(run.err, HasSubstr("frame 45 skipped: " + sequence.Image(45).string() + " cannot be decoded"));
  EXPECT_THAT(run.err, HasSubstr("0050.jpg is 32x24, expected the camera's 320x240"));
  const RunStats stats = ReadStats(Output() / "stats.json");
  EXPECT_EQ(stats.skipped, 3);
  EXPECT_EQ(stats.frames, kPathFrames - 3);
  const Trajectory trajectory = ReadTrajectory(Output() / "trajectory.txt");
  EXPECT_EQ(stats.tracked, static_cast<int>(trajectory.size()));
  EXPECT_GE(stats.tracked, kPathFrames / 2);
  EXPECT_NEAR(trajectory.back().timestamp, (kPathFrames - 1) / 30.0, 1e-6);  // goes on after the bad ones
}

TEST_F(BadInput, ReportsFullDiskAndKeepsWrittenPart) {
  const WrittenSequence sequence(HandHeldPath(kPathFrames));
  // The recording does not fit, the smaller files do.
  const ProgramRun run = Run(sequence, "", "ulimit -f 160");
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.ErrorLines(), ElementsAre(HasSubstr("map.sqmap: ")));
  EXPECT_GE(RecordingReader(Output() / "map.sqmap").Size(), 1);
  EXPECT_GE(ReadTrajectory(Output() / "trajectory.txt").size(), 2u);
  EXPECT_NO_THROW(ReadObjects(Output() / "objects.json"));
}

TEST_F(BadInput, SavesMapOnCtrlC) {
  const WrittenSequence sequence(HandHeldPath(kPathFrames));
  std::vector<int> there_and_back;  // long enough that it cannot end before the signal
  for (int turn = 0; turn < 40; ++turn) {
    for (int i = 0; i < kPathFrames; ++i) {
      there_and_back.push_back(turn % 2 == 0 ? i : kPathFrames - 1 - i);
    }
  }
  sequence.List(there_and_back);
  const pid_t child = ::fork();
  if (child == 0) {
    ::signal(SIGINT, SIG_DFL);  // whatever the tests were started by
    ::execl(SQSLAM_PROGRAM, SQSLAM_PROGRAM, "run", sequence.Path().c_str(), "--output", Output().c_str(),
            "--no-render", "--quiet", "--detector", "none", nullptr);
    ::_exit(127);
  }
  const auto recorded = [&] {
    try {
      return RecordingReader(Output() / "map.sqmap").Size();
    } catch (const InputError&) {
      return 0;  // not there yet
    }
  };
  int status = 0;
  while (recorded() < 2 && ::waitpid(child, &status, WNOHANG) == 0) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  ::kill(child, SIGINT);
  ::waitpid(child, &status, 0);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 130);
  EXPECT_GE(ReadTrajectory(Output() / "trajectory.txt").size(), 2u);
  const RunStats stats = ReadStats(Output() / "stats.json");
  EXPECT_TRUE(stats.interrupted);
  EXPECT_NO_THROW(ReadSavedMap(Output() / "map.sqmap")) << "to go on with";
  EXPECT_LT(stats.frames, static_cast<int>(there_and_back.size()));
}

}  // namespace
}  // namespace sqslam::testing
