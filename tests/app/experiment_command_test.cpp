#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/app/run_program.h"

namespace sqslam::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

// A book and a box on a table, seen in 30 small images: rendered and mapped in a second or two.
constexpr const char* kScene = R"(name: tiny
frames: 30
camera: {width: 320, height: 240, fx: 262.5, fy: 262.5, cx: 159.5, cy: 119.5, fps: 30}
motion:
  tremor_position: 0.0
  tremor_angle: 0.0
  waypoints:
    - {position: [-0.45, -0.8, 0.6], look_at: [0, 0, 0.05]}
    - {position: [-0.15, -0.9, 0.6], look_at: [0, 0, 0.05]}
    - {position: [0.15, -0.9, 0.6], look_at: [0, 0, 0.05]}
    - {position: [0.45, -0.8, 0.6], look_at: [0, 0, 0.05]}
ambient: [0.6, 0.6, 0.6]
lights:
  - {center: [0, 0, 2], half_u: [0.0, 0.4, 0.0], half_v: [0.4, 0.0, 0.0], rgb: [2, 2, 2]}
objects:
  - {id: 1, label: book, half_size: [0.12, 0.09, 0.03], shape: [0.1, 0.1], center: [-0.15, 0, 0], base: 0, yaw: 20,
     texture: {pattern: book, seed: 2, title: "MAPS AND MOTION", colors: [[34, 74, 110], [70, 128, 150], [240, 232, 208], [208, 120, 52], [150, 190, 190]]}}
  - {id: 2, label: cereal_box, half_size: [0.09, 0.04, 0.12], shape: [0.1, 0.1], center: [0.15, 0.05, 0], base: 0, yaw: -10,
     texture: {pattern: package, seed: 1, title: "OAT RINGS", colors: [[226, 178, 52], [238, 214, 120], [176, 36, 34], [250, 240, 215], [60, 34, 28], [24, 82, 130]]}}
panels:
  - {corner: [-0.9, -0.6, 0], u: [1.8, 0, 0], v: [0, 1.4, 0], shading_step: 0.2,
     texture: {pattern: terrazzo, seed: 102, title: "", colors: [[168, 160, 150], [120, 112, 104], [206, 198, 186], [140, 92, 72], [88, 96, 100], [226, 220, 208]]}}
)";

constexpr const char* kExperiment = R"(
sequences: [{scene: tiny.yaml}]
deterministic: true
grids:
  - {representations: [superquadric, quadric]}
)";

class ExperimentCommand : public ::testing::Test {
 protected:
  ProgramRun Run(const std::string& options = "") const {
    return RunProgram("experiment " + (folder_.Path() / "e.yaml").string() + " --output " +
                      Output().string() + " " + options);
  }
  fs::path Output() const { return folder_.Path() / "out"; }

  TemporaryFolder folder_;
};

TEST_F(ExperimentCommand, RunsItsCellsOnceAndWritesTables) {
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

TEST_F(ExperimentCommand, AFailingCellIsSaidAndTheOthersGoOn) {
  folder_.Write("e.yaml", "sequences: [{path: /nonexistent/a}, {path: /nonexistent/b}]\n");
  const ProgramRun run = Run();
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.out, HasSubstr("2 failed"));
  EXPECT_THAT(run.err, AllOf(HasSubstr("a-superquadric-full-refined-1 failed: /nonexistent/a"),
                             HasSubstr("/nonexistent/b")));
  EXPECT_THAT(Slurp(Output() / "tables.md"), HasSubstr("## Failed runs"));
}

TEST_F(ExperimentCommand, CtrlCKeepsWhatIsFinishedAndEndsWith130) {
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

TEST_F(ExperimentCommand, AFolderOfSomebodyElseIsLeftAlone) {
  folder_.Write("e.yaml", "sequences: [{path: a}]\n");
  folder_.Write("out/thesis.tex", "precious");
  EXPECT_EQ(Run().exit_code, 2);
  EXPECT_FALSE(fs::exists(Output() / "tables.md"));
}

TEST_F(ExperimentCommand, ABadConfigurationIsCodeTwo) {
  folder_.Write("e.yaml", "sequences: [{path: a}]\nrepetitons: 2\n");
  const ProgramRun run = Run();
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.ErrorLines(),
              ::testing::ElementsAre(HasSubstr("e.yaml:2: unknown option 'repetitons'; did you mean")));
}

}  // namespace
}  // namespace sqslam::testing
