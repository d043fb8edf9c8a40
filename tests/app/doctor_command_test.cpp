#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/app/run_program.h"
#include "tests/app/written_sequence.h"

namespace sqslam::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

// Sixty frames: the camera walks sideways up to frame `stop`, and stands from there on.
WrittenSequence WalkUntil(int stop) {
  std::vector<Rigid3d> path;
  for (int i = 0; i < 60; ++i) {
    path.push_back({Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.012 * std::min(i, stop), 0.0, 0.0)});
  }
  return WrittenSequence(path);
}

TEST(DoctorCommand, AcceptsWalk) {
  const WrittenSequence sequence = WalkUntil(60);
  const ProgramRun run = RunProgram("doctor " + sequence.Path().string() + " --detector none");
  EXPECT_EQ(run.exit_code, 0) << run.out << run.err;
  EXPECT_THAT(run.out, HasSubstr(": suitable for mapping"));
}

TEST(DoctorCommand, ReportsWhenTheCameraStands) {
  const WrittenSequence sequence = WalkUntil(12);
  const std::string file = (sequence.Path() / "doctor.json").string();
  const ProgramRun run =
      RunProgram("doctor " + sequence.Path().string() + " --detector none --quiet -o " + file);
  EXPECT_EQ(run.exit_code, 0) << "a run maps it all the same";
  const auto document = nlohmann::json::parse(Slurp(file));
  EXPECT_TRUE(document["fit"]);
  EXPECT_EQ(document["mapped"], 1.0);
  ASSERT_EQ(document["findings"].size(), 1U);
  EXPECT_EQ(document["findings"][0]["trouble"], "standstill");
  EXPECT_NEAR(document["findings"][0]["begin"].get<double>(), 0.4, 0.3);
}

TEST(DoctorCommand, RejectsFilmThatCannotBeMapped) {
  const WrittenSequence sequence = WalkUntil(0);
  const ProgramRun run = RunProgram("doctor " + sequence.Path().string() + " --detector none");
  EXPECT_EQ(run.exit_code, 3) << run.out;
  EXPECT_THAT(run.out, HasSubstr("not suitable for mapping: the camera hardly moves"));
}

TEST(DoctorCommand, RejectsInvalidLimits) {
  const ProgramRun run = RunProgram("doctor " + TinySequence().Path().string() + " --set max_blurr=1");
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("max_blur"));
}

}  // namespace
}  // namespace sqslam::testing
