#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/app/run_program.h"
#include "tests/app/tiny_experiment.h"

namespace sqslam::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class ExperimentCommand : public ::testing::Test {
 protected:
  ProgramRun Run(const std::string& options = "") const {
    return RunProgram("experiment " + (folder_.Path() / "e.yaml").string() + " --output " +
                      Output().string() + " " + options);
  }
  fs::path Output() const { return folder_.Path() / "out"; }

  TemporaryFolder folder_;
};

TEST_F(ExperimentCommand, RunsCellsOnceAndWritesTables) {
  folder_.Write("tiny.yaml", kScene);
  folder_.Write("e.yaml", kExperiment);
  const ProgramRun first = Run();
  EXPECT_EQ(first.exit_code, 0) << first.err;
  EXPECT_THAT(first.out,
              AllOf(HasSubstr("rendering tiny"), HasSubstr("[2/2]"), HasSubstr("2 of 2 objects found"),
                    HasSubstr("2 finished (0 of them before)")));
  EXPECT_THAT(Slurp(Output() / "tables.md"),
              AllOf(HasSubstr("| superquadric | quadric |"), HasSubstr("found of 2")));

  // The same again has nothing to do; a cell that is broken off and one that is added are made.
  fs::remove(Output() / "runs/tiny-quadric-full-refined-1/cell.json");
  folder_.Write("e.yaml", std::string(kExperiment) + "  - {max_objects: 1}\n");
  EXPECT_THAT(Run("--dry-run").out, HasSubstr("3 runs, 1 finished"));
  const ProgramRun second = Run("--jobs 2");
  EXPECT_EQ(second.exit_code, 0) << second.err;
  EXPECT_THAT(second.out, AllOf(Not(HasSubstr("rendering")), HasSubstr("3 finished (1 of them before)")));
  EXPECT_THAT(Slurp(Output() / "tables.md"), HasSubstr("2 runs at a time"));
}

TEST_F(ExperimentCommand, ReportsFailingCellAndContinues) {
  folder_.Write("e.yaml", "sequences: [{path: /nonexistent/a}, {path: /nonexistent/b}]\n");
  const ProgramRun run = Run();
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.out, HasSubstr("2 failed"));
  EXPECT_THAT(run.err, AllOf(HasSubstr("a-superquadric-full-refined-1 failed: /nonexistent/a"),
                             HasSubstr("/nonexistent/b")));
  EXPECT_THAT(Slurp(Output() / "tables.md"), HasSubstr("## Failed runs"));
}

TEST_F(ExperimentCommand, StartsNoMoreThreadsThanCells) {
  folder_.Write("e.yaml", "sequences: [{path: /nonexistent/a}]\njobs: 1000000\n");
  EXPECT_THAT(Run().err, HasSubstr("a-superquadric-full-refined-1 failed: /nonexistent/a"));
}

TEST_F(ExperimentCommand, KeepsFinishedCellsWhenInterrupted) {
  folder_.Write("tiny.yaml", kScene);
  folder_.Write("e.yaml", kExperiment);
  const std::string begun = (Output() / "sequences").string();  // made when the scene is about to be rendered
  const ProgramRun run = RunProgram("experiment " + (folder_.Path() / "e.yaml").string() + " --output " +
                                    Output().string() + " & for i in $(seq 500); do [ -e " + begun +
                                    " ] && break; sleep 0.02; done; kill -TERM $!; wait $!");
  EXPECT_EQ(run.exit_code, 130) << run.err;
  EXPECT_THAT(run.err, HasSubstr("interrupted"));
  EXPECT_TRUE(fs::exists(Output() / "tables.md"));
}

TEST_F(ExperimentCommand, LeavesForeignFolderAlone) {
  folder_.Write("e.yaml", "sequences: [{path: a}]\n");
  folder_.Write("out/thesis.tex", "precious");
  EXPECT_EQ(Run().exit_code, 2);
  EXPECT_FALSE(fs::exists(Output() / "tables.md"));
}

TEST_F(ExperimentCommand, ReturnsTwoForBadConfiguration) {
  folder_.Write("e.yaml", "sequences: [{path: a}]\nrepetitons: 2\n");
  const ProgramRun run = Run();
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.ErrorLines(),
              ::testing::ElementsAre(HasSubstr("e.yaml:2: unknown option 'repetitons'; did you mean")));
}

}  // namespace
}  // namespace sqslam::testing
