#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <iterator>

#include "slam/geometry/solid_iou.h"
#include "slam/io/point_cloud.h"
#include "slam/io/result_files.h"
#include "tests/app/run_program.h"
#include "tests/fitting/synthetic_cloud.h"

namespace sqslam::testing {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;

// Two boxes with a gap between them, the first with more points.
class FitCommand : public ::testing::Test {
 protected:
  FitCommand() {
    std::mt19937_64 random(4);
    std::string text;
    const auto add = [&](const PosedSuperquadric& object, int points) {
      for (const Eigen::Vector3d& p : SampleCloud(object, {points, 0.0, 0.005, false}, random)) {
        fmt::format_to(std::back_inserter(text), "{} {} {}\n", p.x(), p.y(), p.z());
      }
    };
    add(first_, 600);
    one_ = folder_.Write("one.xyz", text).string();
    add(second_, 400);
    two_ = folder_.Write("two.xyz", text).string();
  }

  std::string Path(const std::string& name) const { return (folder_.Path() / name).string(); }

  const PosedSuperquadric first_{{{0.3, 0.2, 0.1}, 0.2, 0.2},
                                 {Eigen::Quaterniond(0.8, 0.1, 0.5, 0.3).normalized(), {1, 2, 3}}};
  const PosedSuperquadric second_{{{0.2, 0.2, 0.2}, 1.0, 1.0}, {Eigen::Quaterniond::Identity(), {3, 2, 3}}};
  TemporaryFolder folder_;
  std::string one_;
  std::string two_;
};

TEST_F(FitCommand, WritesObjectsAndMeshes) {
  const ProgramRun run = RunProgram("fit " + one_ + " --output " + Path("a.json") + " --output " +
                                    Path("a.obj") + " --output " + Path("a.ply"));
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("half size"), HasSubstr("rms"), HasSubstr(" %")));
  const auto objects = ReadObjects(Path("a.json"));
  ASSERT_THAT(objects, SizeIs(1));
  EXPECT_GT(IoU(Solid::FromSuperquadric(objects[0].superquadric), Solid::FromSuperquadric(first_)), 0.93);
  EXPECT_GT(objects[0].points, 550);
  EXPECT_THAT(Slurp(Path("a.obj")), HasSubstr("o object_0\n"));
  for (const Eigen::Vector3d& p : ReadPointCloud(Path("a.ply")).points) {
    const Eigen::Vector3d p_object = objects[0].superquadric.T_map_object.Inverse() * p;
    ASSERT_NEAR(objects[0].superquadric.shape.RadialScale(p_object), 1.0, 1e-4);
  }
}

TEST_F(FitCommand, SplitsCloudIntoObjects) {
  EXPECT_EQ(RunProgram("fit " + two_ + " --clusters auto --output " + Path("b.json")).exit_code, 0);
  const auto objects = ReadObjects(Path("b.json"));
  ASSERT_THAT(objects, SizeIs(2));
  EXPECT_GT(IoU(Solid::FromSuperquadric(objects[1].superquadric), Solid::FromSuperquadric(second_)), 0.9);
  EXPECT_EQ(RunProgram("fit " + two_ + " --clusters auto --upright --output " + Path("c.json")).exit_code, 0);
  EXPECT_THAT(ReadObjects(Path("c.json")), SizeIs(2));
}

TEST_F(FitCommand, RepeatsTheSameResult) {
  EXPECT_EQ(RunProgram("fit " + one_).out, RunProgram("fit " + one_).out);
}

TEST_F(FitCommand, ShowsExamplesInHelp) {
  EXPECT_THAT(RunProgram("fit --help").out, AllOf(HasSubstr("Examples:"), HasSubstr("outlier_share")));
}

TEST_F(FitCommand, ReportsWrongUsageInOneLineWithCodeTwo) {
  for (const std::string arguments : {"--output a.glb", "--clusters none", "--clusters 0",
                                      "--set fit.seeds=1", "--set fit.outlier_share=2"}) {
    const ProgramRun run = RunProgram("fit " + one_ + " " + arguments);
    EXPECT_EQ(run.exit_code, 2) << arguments << run.err;
    EXPECT_THAT(run.ErrorLines(), SizeIs(1));
  }
}

TEST_F(FitCommand, NamesUnusableCloudsWithCodeThree) {
  const auto error_of = [&](const std::string& text) {
    const ProgramRun run = RunProgram("fit " + folder_.Write("bad.ply", text).string());
    EXPECT_EQ(run.exit_code, 3) << run.err;
    return run.ErrorLines();
  };
  EXPECT_THAT(error_of("1 2 3\n1 2\n"), ElementsAre(HasSubstr("bad.ply:2: '1 2', expected x y z")));
  EXPECT_THAT(error_of("1 2 3\n"), ElementsAre(HasSubstr("bad.ply: 1 points, expected at least 11")));
  EXPECT_THAT(error_of(""), ElementsAre(HasSubstr("bad.ply: 0 points")));
  EXPECT_EQ(RunProgram("fit /nonexistent.ply").exit_code, 3);
}

}  // namespace
}  // namespace sqslam::testing
