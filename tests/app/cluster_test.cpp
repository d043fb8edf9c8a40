// Work handed to Slurm: to a stand-in for it everywhere, to a real cluster of one node where its packages
// are.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <functional>
#include <nlohmann/json.hpp>
#include <thread>

#include "app/cluster/slurm.h"
#include "slam/snapshot/object_edits.h"
#include "slam/snapshot/recording.h"
#include "tests/app/run_program.h"
#include "tests/app/tiny_experiment.h"
#include "tests/dense/true_result.h"
#include "tests/render/hand_made_map.h"

namespace sqslam::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(JobScript, HasATaskForEachWordAndTheOptionsOfTheCluster) {
  app::SlurmOptions options;
  options.partition = "batch";
  options.time = "1:30:00";
  options.memory = "4G";
  options.sbatch = {"--account=maps"};
  options.setup = {"module load sqslam"};
  options.program = "sqslam";
  const std::string script =
      app::JobScript({"sqslam-desk-1", "/a b/50%", {"a-1", "b-1"}, 7, {"experiment", "e f.yaml"}}, options);
  EXPECT_THAT(script,
              AllOf(HasSubstr("#SBATCH --array=0-1%7\n"), HasSubstr("--output=\"/a b/50%%/%a.log\"\n"),
                    HasSubstr("--partition=batch\n"), HasSubstr("--time=1:30:00\n"), HasSubstr("--mem=4G\n"),
                    HasSubstr("--account=maps\n")));
  EXPECT_THAT(script,
              HasSubstr("\nmodule load sqslam\ntasks=(a-1 b-1)\nexec sqslam experiment 'e f.yaml' --task "
                        "\"${tasks[${SLURM_ARRAY_TASK_ID:-0}]}\"\n"));
  EXPECT_THAT(app::JobScript({"n", "/l", {"end"}, 1, {}}, {}),
              AllOf(Not(HasSubstr("--array")), HasSubstr("\"/l/n.log\""), Not(HasSubstr("partition"))));
}

// Two runs of a tiny film, made at home or handed to what `before` sets up as Slurm.
class ClusterTest : public ::testing::Test {
 protected:
  ClusterTest() {
    folder_.Write("tiny.yaml", kScene);
    folder_.Write("e.yaml", std::string(kExperiment) + "jobs: 2\nslurm: {poll: 0.2, retries: 1}\n");
  }

  ProgramRun Run(const std::string& options, const std::string& output = "out") const {
    return RunProgram(Command(options, output), Before());
  }
  std::string Command(const std::string& options, const std::string& output = "out") const {
    return "experiment " + (folder_.Path() / "e.yaml").string() + " --output " +
           (folder_.Path() / output).string() + " " + options;
  }
  virtual std::string Before() const = 0;
  fs::path Output() const { return folder_.Path() / "out"; }
  std::string Tables(const std::string& output, const std::string& number) const {
    return Slurp(folder_.Path() / output / ("table-" + number + ".csv"));
  }
  bool WaitFor(const fs::path& file) const {
    for (int i = 0; i < 600 && !fs::exists(file); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    return fs::exists(file);
  }

  // Holds on any cluster: the tables are those of home, from tasks that say where they were made.
  void ExpectTheTablesOfHome() const {
    const ProgramRun home = Run("", "home");
    EXPECT_EQ(home.exit_code, 0) << home.err;
    for (const char* number : {"1", "2", "3"}) {
      EXPECT_EQ(Tables("out", number), Tables("home", number));
    }
    const auto stats =
        nlohmann::json::parse(Slurp(Output() / "runs/tiny-superquadric-full-refined-1/stats.json"));
    EXPECT_THAT(stats.at("job").get<std::string>(), HasSubstr("_0"));
    EXPECT_NE(stats.at("host"), "");
    EXPECT_NE(stats.at("version"), "");
    EXPECT_THAT(stats.at("command").get<std::string>(),
                HasSubstr("/out/runs/tiny-superquadric-full-refined-1 "));
    const auto at_home =
        nlohmann::json::parse(Slurp(folder_.Path() / "home/runs/tiny-quadric-full-refined-1/stats.json"));
    EXPECT_EQ(at_home.at("job"), "");
    for (const auto& entry : fs::directory_iterator(Output() / "runs")) {
      EXPECT_FALSE(entry.path().filename().string().starts_with('.')) << entry.path();
    }
  }

  TemporaryFolder folder_;
};

// sbatch and squeue as files of the shell: the tasks of a job run one after the other, and those that `lost`
// names are never begun.
class StandIn : public ClusterTest {
 protected:
  StandIn() {
    folder_.Write("bin/sbatch", R"sh(#!/bin/bash
cd "$(dirname "$0")/.."
if [ -e refuse ]; then echo 'sbatch: error: invalid partition specified: none' >&2; exit 1; fi
echo job >>jobs
number=$(wc -l <jobs)
cp "${@: -1}" job$number.sh
name=$(sed -n 's/^#SBATCH --job-name=//p' job$number.sh)
last=$(sed -n 's/^#SBATCH --array=0-\([0-9]*\)%.*/\1/p' job$number.sh)
after=$(echo "$@" | sed -n 's/.*afterany:\([0-9]*\).*/\1/p')
mkdir -p queue
for k in $(seq 0 ${last:-0}); do touch queue/$number,$name,$k; done
(
  for fd in $(ls /proc/$BASHPID/fd); do if [ $fd -gt 2 ]; then eval "exec $fd>&-"; fi; done
  while [ -n "$after" ] && ls queue/$after,* >/dev/null 2>&1; do sleep 0.1; done
  while [ -e hold ]; do sleep 0.1; done
  for k in $(seq 0 ${last:-0}); do
    if [ -e lost ] && [ "$(cat lost)" = $number,$k ]; then rm -f queue/$number,$name,$k; continue; fi
    export SLURM_JOB_ID=$number
    if [ -n "$last" ]; then export SLURM_ARRAY_JOB_ID=$number SLURM_ARRAY_TASK_ID=$k; fi
    bash job$number.sh >>task.log 2>&1
    rm -f queue/$number,$name,$k
  done
) >/dev/null 2>&1 &
echo $number
echo 'sbatch: warning: this cluster is down on Monday' >&2
)sh");
    folder_.Write("bin/squeue", R"sh(#!/bin/bash
cd "$(dirname "$0")/.."
name=$(echo "$@" | sed 's/.*-n \([^ ]*\).*/\1/')
echo 'squeue: warning: slow today' >&2
for task in queue/*,$name,*; do if [ -e "$task" ]; then basename "$task" | cut -d, -f1; fi; done
exit 0
)sh");
    fs::permissions(folder_.Path() / "bin/sbatch", fs::perms::owner_all);
    fs::permissions(folder_.Path() / "bin/squeue", fs::perms::owner_all);
  }
  ~StandIn() override {  // its tasks write into the folder
    fs::remove(folder_.Path() / "hold");
    while (fs::exists(folder_.Path() / "queue") && !fs::is_empty(folder_.Path() / "queue")) {
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
  }

  std::string Before() const override {
    return "unset SLURM_JOB_ID SLURM_ARRAY_JOB_ID; export PATH=" + (folder_.Path() / "bin").string() +
           ":$PATH";
  }
  std::size_t Jobs() const { return Slurp(folder_.Path() / "jobs").size() / 4; }
};

TEST_F(StandIn, MakesTheTablesOfHomeAndALostTaskAgain) {
  folder_.Write("lost", "1,1\n");
  const ProgramRun run = Run("--on slurm");
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("job 1 of 2 tasks"), HasSubstr("job 2 of 1 task "), HasSubstr("[2/2]"),
                             HasSubstr("2 finished (0 of them before)")));
  EXPECT_EQ(Jobs(), 2u);
  ExpectTheTablesOfHome();
  EXPECT_THAT(Run("--on slurm").out, HasSubstr("2 finished (2 of them before)"));
  EXPECT_EQ(Jobs(), 2u);
}

TEST_F(StandIn, TheEndOfTheLastRunIsSeenBeforeTheQueueIsAskedAgain) {
  folder_.Write("e.yaml", std::string(kExperiment) + "slurm: {poll: 3600}\n");
  const ProgramRun run = Run("--on slurm");
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("2 finished (0 of them before)"));
}

TEST_F(StandIn, IsTakenUpAgainWhereItWasLeft) {
  folder_.Write("hold", "");
  const ProgramRun left =
      RunProgram(Command("--on slurm & while ! [ -e " + (folder_.Path() / "queue").string() +
                         " ]; do sleep 0.05; done; kill -KILL $!; wait $!"),
                 Before());
  EXPECT_EQ(left.exit_code, 128 + SIGKILL);
  const std::string said = (folder_.Path() / "said").string();
  const ProgramRun stopped = RunProgram(Command("--on slurm >" + said + " & while ! grep -q queue " + said +
                                                "; do sleep 0.05; done; kill -TERM $!; wait $!"),
                                        Before());
  EXPECT_EQ(stopped.exit_code, 130) << stopped.err;
  EXPECT_THAT(Slurp(said), HasSubstr("2 tasks of sqslam-out-"));
  fs::remove(folder_.Path() / "hold");
  const ProgramRun run = Run("--on slurm");
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(Jobs(), 1u);
  ExpectTheTablesOfHome();
}

TEST_F(StandIn, ALastJobMakesLostTasksAgainAndTheTables) {
  folder_.Write("lost", "1,0\n");
  const ProgramRun run = Run("--on slurm --submit-only");
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("a last job makes the tables"));
  ASSERT_TRUE(WaitFor(Output() / "tables.md")) << Slurp(folder_.Path() / "task.log");
  EXPECT_EQ(Jobs(), 4u);  // two arrays, each with its last job
  EXPECT_THAT(Slurp(Output() / "tables.md"), HasSubstr("2 of 2 runs"));
}

TEST_F(StandIn, AFailingRunIsMadeAgainAsOftenAsItMay) {
  folder_.Write("e.yaml", "sequences: [{path: /nonexistent/a}]\nslurm: {poll: 0.1, retries: 1}\n");
  const ProgramRun run = Run("--on slurm");
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_EQ(Jobs(), 2u);
  EXPECT_THAT(run.out, HasSubstr("FAILED: /nonexistent/a"));
  EXPECT_THAT(run.err, HasSubstr("a-superquadric-full-refined-1 failed: /nonexistent/a"));
  EXPECT_THAT(Slurp(Output() / "tables.md"), HasSubstr("## Failed runs"));
}

TEST_F(StandIn, WhatSlurmRefusesIsSaid) {
  folder_.Write("refuse", "");
  const ProgramRun refused = Run("--on slurm");
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_THAT(refused.err, HasSubstr("invalid partition specified: none"));
  const ProgramRun none = RunProgram(Command("--on slurm"), "export PATH=/nonexistent");
  EXPECT_EQ(none.exit_code, 3);
  EXPECT_THAT(none.err, HasSubstr("expected a Slurm cluster here"));
  EXPECT_EQ(Run("--submit-only").exit_code, 2);
  EXPECT_EQ(Run("--task nothing").exit_code, 2);
}

TEST_F(StandIn, DrawsAVideoInPiecesAndThoseAgainThatAreCut) {
  const fs::path map = folder_.Path() / "map.sqmap";
  {
    RecordingWriter writer(map, {});
    writer.Add(HandMadeMap());
    writer.Close();
  }
  // Nine frames: pieces of four, where the encoder changes their order, and of one, where it does not.
  const auto render = [&](const std::string& output, const std::string& options) {
    return RunProgram("render " + map.string() +
                          " --resolution 320,240 --rendering-backend osmesa --quiet "
                          "--fps 2 --seconds 4.5 --output " +
                          (folder_.Path() / output).string() + " " + options,
                      Before());
  };
  folder_.Write("slurm.yaml", "poll: 0.2\n");
  folder_.Write("lost", "1,1\n");
  const fs::path pieces = folder_.Path() / "film.mp4.pieces";
  const std::string on_slurm = "--on slurm --shards 3 --slurm " + (folder_.Path() / "slurm.yaml").string();
  EXPECT_EQ(render("film.mp4", on_slurm + " --task 1/3").exit_code, 0);
  fs::resize_file(pieces / "film.part-1-of-3.mp4", 100);  // a disk that was full
  const ProgramRun run = render("film.mp4", on_slurm);
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(Jobs(), 2u);
  EXPECT_FALSE(fs::exists(pieces));
  EXPECT_EQ(render("whole.mp4", "").exit_code, 0);
  EXPECT_EQ(Slurp(folder_.Path() / "film.mp4"), Slurp(folder_.Path() / "whole.mp4"));
  EXPECT_EQ(render("film.png", on_slurm).exit_code, 2);
}

TEST_F(StandIn, PiecesOfAVideoCountUntilAFileThatTheyAreDrawnFromChanges) {
  const fs::path map = folder_.Path() / "map.sqmap";
  RecordingWriter writer(map, {});
  writer.Add(HandMadeMap());
  writer.Close();
  const auto hide = [&](int object) {
    ObjectEdits edits;
    edits.Hide(object);
    WriteObjectEdits(EditsFileOf(map), edits);
  };
  hide(0);
  const std::string film = (folder_.Path() / "film.mp4").string();
  const std::string command =
      "render " + map.string() + " --resolution 160,120 --rendering-backend osmesa --quiet --fps 1 --style " +
      folder_.Write("style.yaml", "background: \"#ffffff\"\n").string() + " --camera-path " +
      folder_.Write("path.yaml", "keys: [{time: 0, view: front}, {time: 4, view: left}]\n").string() +
      " --dense-cloud " + folder_.Write("cloud.txt", "0 0 0\n0 0 1\n0 1 0\n1 0 0\n").string() +
      " --edits auto --output " + film + " --on slurm --shards 2";
  folder_.Write("refuse", "");
  const auto counts_after_taking_up = [&] {
    EXPECT_THAT(RunProgram(command, Before()).err, HasSubstr("invalid partition"));
    return fs::exists(film + ".pieces/film.part-1-of-2.mp4.size");
  };
  const std::vector<std::function<void()>> changes = {
      [&] { hide(1); }, [&] { folder_.Write("style.yaml", "background: \"#eeeeee\"\n"); },
      [&] { folder_.Write("path.yaml", "keys: [{time: 0, view: front}, {time: 4, view: right}]\n"); },
      [&] { folder_.Write("cloud.txt", "0 0 0\n0 0 1\n0 1 0\n2 0 0\n"); }};
  for (std::size_t i = 0; i < changes.size(); ++i) {
    const ProgramRun piece = RunProgram(command + " --task 1/2", Before());
    EXPECT_EQ(piece.exit_code, 0) << piece.err;
    EXPECT_TRUE(counts_after_taking_up()) << i;
    changes[i]();
    EXPECT_FALSE(counts_after_taking_up()) << i;
  }
  fs::remove(folder_.Path() / "refuse");
  const fs::path slurm = folder_.Write("slurm.yaml", "poll: 0.2\nsetup: [\"sed -i s/right/left/ " +
                                                         (folder_.Path() / "path.yaml").string() + "\"]\n");
  const ProgramRun mixed = RunProgram(command + " --slurm " + slurm.string(), Before());
  EXPECT_EQ(mixed.exit_code, 3);
  EXPECT_THAT(mixed.err, HasSubstr("has changed while the pieces were made"));
  EXPECT_FALSE(fs::exists(film));
}

// A result to be densified, and another that was on one computer.
struct DensifiedResults {
  static constexpr const char* kFast =
      " -q --set dense.stereo.planes=32 --set dense.views.min_overlap=0.3 --set dense.surface.min_island=50 ";

  DensifiedResults() { EXPECT_EQ(RunProgram("densify " + whole.Path().string() + kFast).exit_code, 0); }

  std::string Command(const std::string& options) const {
    return "densify " + shared.Path().string() + kFast + "--on slurm --shards 3 " + options;
  }
  void ExpectSame() const {
    for (const char* file : {"dense.ply", "dense.glb"}) {
      EXPECT_TRUE(Slurp(shared.Path() / file) == Slurp(whole.Path() / file)) << file;
      EXPECT_GT(fs::file_size(shared.Path() / file), 10000U);
    }
    EXPECT_FALSE(fs::exists(Pieces()));
  }
  fs::path Pieces() const { return shared.Path() / "dense.sqmap.pieces"; }

  TrueResult whole{Pan(13, 0.06)}, shared{Pan(13, 0.06)};
};

TEST_F(StandIn, DensifiesInPiecesAndMakesThoseAgainThatAreCut) {
  const DensifiedResults results;
  folder_.Write("slurm.yaml", "poll: 0.2\n");
  folder_.Write("lost", "1,1\n");
  const std::string file = "--slurm " + (folder_.Path() / "slurm.yaml").string();
  EXPECT_EQ(RunProgram(results.Command(file + " --task 1/3"), Before()).exit_code, 0);
  fs::resize_file(results.Pieces() / "dense.part-1-of-3.sqmap", 100);  // a disk that was full
  const ProgramRun run = RunProgram(results.Command(file), Before());
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(Jobs(), 2u);
  results.ExpectSame();
}

TEST(DensifyInPieces, ByHandNeedsNoSlurmAndWritesThePieceAlone) {
  const DensifiedResults results;
  const fs::path map = results.shared.Path() / "map.sqmap";
  const std::string before = Slurp(map);
  const auto run = [&](const std::string& options) {
    return RunProgram(results.Command(options), "export PATH=/nonexistent").exit_code;
  };
  for (const char* task : {"--task 3/3", "--task 1/3", "--task 2/3"}) {
    EXPECT_EQ(run(task), 0) << task;
  }
  EXPECT_TRUE(Slurp(map) == before);
  const auto made = fs::last_write_time(results.Pieces() / "dense.part-2-of-3.sqmap");
  EXPECT_EQ(run("--task 2/3"), 0);
  EXPECT_EQ(fs::last_write_time(results.Pieces() / "dense.part-2-of-3.sqmap"), made);
  EXPECT_EQ(run("--task end"), 0);
  results.ExpectSame();
  EXPECT_EQ(run("--task 4/4"), 2);
  EXPECT_EQ(RunProgram("densify " + results.shared.Path().string() + " --shards 3").exit_code, 2);
}

TEST_F(StandIn, ATaskThatIsTakenOffItsNodeAgainAndAgainIsGivenUp) {
  const ProgramRun run =
      RunProgram(Command("--task tiny-quadric-full-refined-1"), "export SLURM_RESTART_COUNT=2");
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(Slurp(Output() / "runs/tiny-quadric-full-refined-1.failed"), HasSubstr("taken off its node"));
}

TEST_F(StandIn, ATaskByHandLeavesAFolderThatIsGoneOnWith) {
  EXPECT_EQ(Run("--task tiny-quadric-full-refined-1").exit_code, 0);
  EXPECT_FALSE(fs::exists(Output() / "tables.md"));
  EXPECT_THAT(Run("--dry-run").out, HasSubstr("2 runs, 1 finished"));
  EXPECT_THAT(Run("").out, HasSubstr("2 finished (1 of them before)"));
}

TEST(FullDisk, AnErrorThatCannotBePrintedKeepsItsExitCode) {
  EXPECT_EQ(RunProgram("info /nonexistent 2>/dev/full").exit_code, 3);
}

// A real cluster of this machine alone.
class RealSlurm : public ClusterTest {
 protected:
  static constexpr const char* kScript = SQSLAM_SOURCE_DIR "/scripts/local-slurm.sh ";

  void SetUp() override {
    if (::getuid() != 0) {
      GTEST_SKIP() << "only root can start a Slurm cluster; a stand-in was tried in its place";
    }
    if (std::system("command -v slurmctld slurmd sbatch munged >/dev/null") != 0) {
      GTEST_SKIP()
          << "no Slurm here (slurmctld, slurmd, slurm-client, munge); a stand-in was tried in its place";
    }
    started_ = std::system((Before() + "; " + kScript + "start " + Cluster().string()).c_str()) == 0;
    ASSERT_TRUE(started_) << Slurp(Cluster() / "slurmctld.log");
  }
  void TearDown() override {
    if (started_) {
      EXPECT_EQ(std::system((std::string(kScript) + "stop " + Cluster().string()).c_str()), 0);
    }
  }
  fs::path Cluster() const { return folder_.Path() / "cluster"; }
  std::string Before() const override {
    return "export SLURM_CONF=" + (Cluster() / "slurm.conf").string() +
           " SLURM_PORT=" + std::to_string(20000 + 2 * (::getpid() % 5000));
  }

  bool started_ = false;
};

TEST_F(RealSlurm, MakesTheTablesOfHomeThoughItsFollowerIsKilledAndATaskCancelled) {
  const std::string cancel = "scancel $(squeue -h -r -o %i | tail -1)";
  RunProgram(
      Command("--on slurm & while ! squeue -h | grep -q .; do sleep 0.1; done; kill -KILL $!; wait $!; " +
              cancel),
      Before());
  const ProgramRun run = Run("--on slurm");
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("handed to Slurm"));
  ExpectTheTablesOfHome();
}

TEST_F(RealSlurm, DensifiesInPieces) {
  const DensifiedResults results;
  const ProgramRun run = RunProgram(results.Command(""), Before());
  EXPECT_EQ(run.exit_code, 0) << run.err;
  results.ExpectSame();
}

}  // namespace
}  // namespace sqslam::testing
