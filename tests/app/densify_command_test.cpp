#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <thread>

#include "slam/io/point_cloud.h"
#include "slam/snapshot/depth_recording.h"
#include "slam/snapshot/recording.h"
#include "slam/util/error.h"
#include "tests/app/run_program.h"
#include "tests/app/written_sequence.h"
#include "tests/dense/true_result.h"
#include "tests/support/textured_world.h"

namespace sqslam::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr const char* kFast =
    " --set dense.stereo.planes=32 --set dense.views.min_overlap=0.3 --set dense.surface.min_island=50";

TEST(DensifyCommand, WritesCloudAndMeshForExport) {
  const TrueResult result(Pan(13, 0.06));
  const ProgramRun run = RunProgram("densify " + result.Path().string() + kFast);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("dense.glb"));
  EXPECT_GT(ReadPointCloud(result.Path() / "dense.ply").points.size(), 1000U);
  EXPECT_THAT(Slurp(result.Path() / "dense.glb"), HasSubstr(R"("name":"surface")"));

  const fs::path whole = result.Path() / "whole.glb";
  const std::string export_it = "export " + result.Path().string() + " -o " + whole.string();
  ASSERT_EQ(RunProgram(export_it).exit_code, 0);
  EXPECT_THAT(Slurp(whole), Not(HasSubstr(R"("name":"surface")")));
  ASSERT_EQ(RunProgram(export_it + " --surface").exit_code, 0);
  EXPECT_THAT(Slurp(whole), HasSubstr(R"("name":"surface")"));
  EXPECT_EQ(RunProgram("export " + result.Path().string() + " -o x.json --surface").exit_code, 2);
  const auto fine = fs::file_size(whole);  // the mesh is made as the result was densified
  ASSERT_EQ(
      RunProgram("densify -q " + result.Path().string() + kFast + " --set dense.surface.voxel=6").exit_code,
      0);
  ASSERT_EQ(RunProgram(export_it + " --surface").exit_code, 0);
  EXPECT_LT(fs::file_size(whole), fine / 2);
}

TEST(DensifyCommand, WritesNoMeshWhenAsked) {
  const TrueResult result(Pan(13, 0.06));
  ASSERT_EQ(RunProgram("densify --no-mesh -q " + result.Path().string() + kFast).exit_code, 0);
  EXPECT_TRUE(fs::exists(result.Path() / "dense.ply"));
  EXPECT_FALSE(fs::exists(result.Path() / "dense.glb"));
}

TEST(DensifyCommand, ReportsBadInputInOneLineAndKeepsTheMap) {
  const TrueResult still(Pan(13, 0.0001));
  const ProgramRun no_motion = RunProgram("densify " + still.Path().string() + kFast);
  EXPECT_EQ(no_motion.exit_code, 4);
  EXPECT_THAT(no_motion.ErrorLines(), ElementsAre(HasSubstr("expected a camera that moves sideways")));

  const TrueResult result(Pan(13, 0.06));
  fs::rename(result.Images().Path() / "rgb", result.Images().Path() / "elsewhere");
  const ProgramRun no_images = RunProgram("densify " + result.Path().string() + kFast);
  EXPECT_EQ(no_images.exit_code, 3);
  EXPECT_THAT(no_images.ErrorLines(), ElementsAre(HasSubstr("expected them there or with --images")));
  fs::rename(result.Images().Path() / "elsewhere", result.Images().Path() / "rgb");

  const ProgramRun full_disk =  // files may grow to 64 KiB: not even the depth maps fit
      RunProgram("densify " + result.Path().string() + kFast, "trap '' XFSZ; ulimit -f 64");
  EXPECT_EQ(full_disk.exit_code, 3);
  EXPECT_THAT(full_disk.ErrorLines(), ElementsAre(HasSubstr("map.sqmap")));
  EXPECT_EQ(RecordingReader(result.Path() / "map.sqmap").Size(), 1);
  EXPECT_EQ(RunProgram("densify -q " + result.Path().string() + kFast).exit_code, 0);  // and it goes on
}

TEST(DensifyCommand, RejectsSurfaceExportOfSparseResult) {
  const TrueResult result(Pan(13, 0.06));
  const ProgramRun run =
      RunProgram("export " + result.Path().string() + " --surface -o " + (result.Path() / "x.glb").string());
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.ErrorLines(), ElementsAre(HasSubstr("expected those of sqslam densify")));
}

// Keyframes with an estimate in a recording that may not be there yet.
std::size_t Estimated(const fs::path& result) {
  try {
    return DepthRecording(result / "map.sqmap").Estimated().size();
  } catch (const InputError&) {
    return 0;
  }
}

TEST(DensifyCommand, ResumesToTheSameCloudAfterCtrlC) {
  const TrueResult stopped(Pan(61, 0.015)), whole(Pan(61, 0.015));
  const std::string slow = " --set dense.stereo.planes=256 --set dense.views.min_overlap=0.3 --no-mesh";
  ASSERT_EQ(RunProgram("densify -q --threads 3 " + whole.Path().string() + slow).exit_code, 0);

  const std::string err = (stopped.Path() / "err.txt").string();
  const pid_t child = ::fork();
  if (child == 0) {
    ::signal(SIGINT, SIG_DFL);  // whatever the tests were started by
    if (::freopen(err.c_str(), "w", stderr) != nullptr) {
      ::execl(SQSLAM_PROGRAM, "sqslam", "densify", stopped.Path().c_str(), "--threads", "1", "--no-mesh",
              "--set", "dense.stereo.planes=256", "--set", "dense.views.min_overlap=0.3", nullptr);
    }
    ::_exit(99);
  }
  int status = 0;
  while (Estimated(stopped.Path()) < 2 && ::waitpid(child, &status, WNOHANG) == 0) {
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  ::kill(child, SIGINT);
  ::waitpid(child, &status, 0);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 130);
  const std::size_t done = Estimated(stopped.Path());
  EXPECT_GE(done, 2U);
  EXPECT_LT(done, Estimated(whole.Path()));
  EXPECT_THAT(Slurp(err), HasSubstr("stopped after " + std::to_string(done) +
                                    " depth maps; run the same command to resume"));
  EXPECT_FALSE(fs::exists(stopped.Path() / "dense.ply"));

  const ProgramRun second = RunProgram("densify --threads 2 " + stopped.Path().string() + slow);
  ASSERT_EQ(second.exit_code, 0) << second.err;
  EXPECT_THAT(second.out, HasSubstr("(" + std::to_string(Estimated(whole.Path()) - done) + " new)"));
  EXPECT_EQ(Slurp(stopped.Path() / "dense.ply"), Slurp(whole.Path() / "dense.ply"));
}

TEST(RunCommand, AcceptsDenseWithAndWithoutValue) {
  const TrueResult result(Pan(13, 0.06));
  const std::string images = result.Images().Path().string();
  const ProgramRun live = RunProgram("run --dense live --deterministic " + images);
  EXPECT_EQ(live.exit_code, 2);
  EXPECT_THAT(live.ErrorLines(), ElementsAre(HasSubstr("expected --dense final with --deterministic")));
  EXPECT_THAT(RunProgram("run --dense " + images + "/nothing").ErrorLines(),  // the word after it is INPUT
              ElementsAre(HasSubstr("nothing")));
  EXPECT_THAT(RunProgram("run --dense=later " + images).ErrorLines(),
              ElementsAre(HasSubstr("expected one of final, live")));
  EXPECT_THAT(RunProgram("run --dense --no-dense " + images).ErrorLines(),
              ElementsAre(HasSubstr("--dense and --no-dense: expected one of them")));
}

// A cloud is made for pictures alone, and localize, --extend and merge keep it.
TEST(RunCommand, MakesCloudForPictures) {
  const WrittenSequence sequence(HandHeldPath(50));
  const TemporaryFolder folder;
  const auto out = [&](const std::string& name) { return folder.Path() / name; };
  const std::string options = std::string(kFast) + " --set dense.scale=0.25 --detector none --quiet ";
  const auto run = [&](const std::string& name, const std::string& more) {
    const ProgramRun made =
        RunProgram("run " + sequence.Path().string() + options + more + " -o " + out(name).string());
    EXPECT_EQ(made.exit_code, 0) << made.err;
  };
  const auto keyframes = [&](const std::string& name) {
    return DepthRecording(out(name) / "map.sqmap").Keyframes().size();
  };
  run("map", "--deterministic --frames 40");
  EXPECT_TRUE(fs::exists(out("map") / "dense.glb"));
  EXPECT_GE(keyframes("map"), 3U);
  run("none", "--no-render --frames 20:");
  EXPECT_EQ(keyframes("none"), 0U);
  run("both", "--frames 20: --extend " + out("map").string());
  EXPECT_GE(keyframes("both"), keyframes("map"));
  const std::string map = out("map").string();
  fs::copy(out("map"), out("moved"), fs::copy_options::recursive);
  SetSequencePath(out("moved") / "map.sqmap", "/nowhere");  // its images are gone
  run("kept", "--frames 20: --extend " + out("moved").string());
  EXPECT_GE(keyframes("kept"), keyframes("map") - 1);
  ASSERT_EQ(
      RunProgram("merge -q " + map + " " + out("none").string() + " -o " + out("merged").string()).exit_code,
      0);
  EXPECT_GE(keyframes("merged"), keyframes("map"));
  ASSERT_EQ(RunProgram("localize -q " + sequence.Path().string() + " --frames 10:15 --map " + map + " -o " +
                       out("found").string())
                .exit_code,
            0);
  EXPECT_EQ(keyframes("found"), keyframes("map"));
}

}  // namespace
}  // namespace sqslam::testing
