#include "slam/run/run_pipeline.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/sinks/dist_sink.h>
#include <spdlog/spdlog.h>

#include <stdexcept>

#include "slam/run/map_files.h"
#include "slam/snapshot/recording.h"
#include "slam/util/error.h"
#include "slam/util/text_lines.h"
#include "tests/app/written_sequence.h"
#include "tests/support/textured_world.h"

namespace sqslam {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::ElementsAre;

constexpr int kFrames = 40;

// Keeps what it is told, and sees at each step which files there are.
class WatchfulHost : public RunHost {
 public:
  bool AdmitFrame() override { return admitted < last_frame && ++admitted > 0; }
  bool Stopped() const override { return admitted >= last_frame; }
  void Mapped(const MapSnapshotPtr&) override { ++snapshots; }
  void Draw(const FinishedRun& run, StageTimes& times) override {
    steps.emplace_back("draw");
    times.Add("render", 1.0);
    EXPECT_TRUE(fs::exists(run.output / "trajectory.txt"));
    EXPECT_EQ(RecordingReader(run.output / "map.sqmap").Size(), snapshots);
    EXPECT_FALSE(fs::exists(run.output / "stats.json"));
    spdlog::warn("it is dark");
    if (blind) {
      throw std::runtime_error("no display");
    }
  }
  void Film(const FinishedRun&) override { steps.emplace_back("film"); }
  void Report(const FinishedRun& run) override {
    steps.emplace_back("report");
    EXPECT_EQ(ReadStats(run.output / "stats.json").timing_ms.contains("render"), !blind);
  }

  int last_frame = 1000;
  bool blind = false;
  int admitted = 0;
  int snapshots = 0;
  std::vector<std::string> steps;
};

class RunPipelineTest : public ::testing::Test {
 protected:
  RunRequest Request(const std::string& name) const {
    RunRequest request;
    request.sequence.path = sequence_.Path();
    request.output = folder_.Path() / name;
    request.options.deterministic = true;
    request.options.vocabulary = "none";
    request.options.detection.network = "none";
    return request;
  }
  std::string Recording(const std::string& name) const {
    return ReadFile(folder_.Path() / name / "map.sqmap", "a recording");
  }

  const testing::WrittenSequence sequence_{testing::HandHeldPath(kFrames)};
  const TemporaryFolder folder_;
};

TEST_F(RunPipelineTest, DrawsPicturesAndRepeatsDeterministicRecordings) {
  WatchfulHost host;
  const FinishedRun run = RunPipeline(Request("a"), host);
  EXPECT_THAT(host.steps, ElementsAre("draw", "film", "report"));
  EXPECT_FALSE(run.interrupted);
  EXPECT_EQ(run.stats.frames, kFrames);
  EXPECT_GT(run.stats.tracked, kFrames / 2);
  EXPECT_EQ(run.result.map.trajectory.size(), static_cast<std::size_t>(run.stats.tracked));
  RunHost silent;
  RunPipeline(Request("b"), silent);
  EXPECT_EQ(Recording("a"), Recording("b"));
}

TEST_F(RunPipelineTest, WritesOtherFilesWhenOnePictureFails) {
  WatchfulHost host;
  host.blind = true;
  EXPECT_THROW(RunPipeline(Request("a"), host), std::runtime_error);
  EXPECT_THAT(host.steps, ElementsAre("draw", "film", "report"));
}

TEST_F(RunPipelineTest, KeepsWarningsOfLastSteps) {
  const auto before = spdlog::default_logger();
  spdlog::set_default_logger(
      std::make_shared<spdlog::logger>("test", std::make_shared<spdlog::sinks::dist_sink_mt>()));
  WatchfulHost host;
  const FinishedRun run = RunPipeline(Request("a"), host);
  spdlog::set_default_logger(before);
  EXPECT_THAT(ReadStats(run.output / "stats.json").warnings, Contains("it is dark"));
}

TEST_F(RunPipelineTest, SavesMapWhenHostStopsRun) {
  WatchfulHost host;
  host.last_frame = kFrames - 10;
  const FinishedRun run = RunPipeline(Request("a"), host);
  EXPECT_TRUE(run.interrupted);
  EXPECT_EQ(run.stats.frames, kFrames - 10);
  EXPECT_TRUE(ReadStats(run.output / "stats.json").interrupted);
  EXPECT_EQ(RecordingReader(run.output / "map.sqmap").Size(), host.snapshots);
}

TEST(AttemptAll, ContinuesAfterFailuresAndThrowsTheFirst) {
  int done = 0;
  const auto count = [&] { ++done; };
  const auto full = [] { throw InputError("the disk is full"); };
  const auto blind = [] { throw std::runtime_error("no display"); };
  EXPECT_THROW(AttemptAll({count, full, count, blind, count}), InputError);
  EXPECT_EQ(done, 3);
  EXPECT_THROW(AttemptAll({blind, full, count}), std::runtime_error);
  EXPECT_EQ(done, 4);
  EXPECT_NO_THROW(AttemptAll({count}));
}

}  // namespace
}  // namespace sqslam
