// Work handed to Slurm: to a stand-in for it everywhere, to a real cluster of one node where its packages
// are.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "app/cluster/slurm.h"
#include "tests/app/cluster_fixtures.h"

namespace sqslam::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(JobScript, ContainsTasksAndClusterOptions) {
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

TEST_F(StandIn, WritesLocalTablesAndRepeatsLostTask) {
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

TEST_F(StandIn, NoticesLastResultBeforeNextQueueQuery) {
  folder_.Write("e.yaml", std::string(kExperiment) + "slurm: {poll: 3600}\n");
  const ProgramRun run = Run("--on slurm");
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("2 finished (0 of them before)"));
}

TEST_F(StandIn, ResumesAfterInterruption) {
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

TEST_F(StandIn, RepeatsLostTasksAndWritesTablesInLastJob) {
  folder_.Write("lost", "1,0\n");
  const ProgramRun run = Run("--on slurm --submit-only");
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("a last job makes the tables"));
  ASSERT_TRUE(WaitFor(Output() / "tables.md")) << Slurp(folder_.Path() / "task.log");
  EXPECT_EQ(Jobs(), 4u);  // two arrays, each with its last job
  EXPECT_THAT(Slurp(Output() / "tables.md"), HasSubstr("2 of 2 runs"));
}

TEST_F(StandIn, RepeatsFailingRunUpToRetries) {
  folder_.Write("e.yaml", "sequences: [{path: /nonexistent/a}]\nslurm: {poll: 0.1, retries: 1}\n");
  const ProgramRun run = Run("--on slurm");
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_EQ(Jobs(), 2u);
  EXPECT_THAT(run.out, HasSubstr("FAILED: /nonexistent/a"));
  EXPECT_THAT(run.err, HasSubstr("a-superquadric-full-refined-1 failed: /nonexistent/a"));
  EXPECT_THAT(Slurp(Output() / "tables.md"), HasSubstr("## Failed runs"));
}

TEST_F(StandIn, ReportsRejectionBySlurm) {
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

TEST_F(StandIn, GivesUpOnRepeatedlyRequeuedTask) {
  const ProgramRun run =
      RunProgram(Command("--task tiny-quadric-full-refined-1"), "export SLURM_RESTART_COUNT=2");
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(Slurp(Output() / "runs/tiny-quadric-full-refined-1.failed"), HasSubstr("requeued more than"));
}

TEST_F(StandIn, ManualTaskLeavesResumableFolder) {
  EXPECT_EQ(Run("--task tiny-quadric-full-refined-1").exit_code, 0);
  EXPECT_FALSE(fs::exists(Output() / "tables.md"));
  EXPECT_THAT(Run("--dry-run").out, HasSubstr("2 runs, 1 finished"));
  EXPECT_THAT(Run("").out, HasSubstr("2 finished (1 of them before)"));
}

TEST(FullDisk, KeepsExitCodeWhenErrorCannotBePrinted) {
  EXPECT_EQ(RunProgram("info /nonexistent 2>/dev/full").exit_code, 3);
}

TEST_F(RealSlurm, WritesLocalTablesAfterKillAndCancel) {
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

}  // namespace
}  // namespace sqslam::testing
