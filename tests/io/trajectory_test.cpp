#include "slam/io/trajectory.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "tests/io/captured_log.h"
#include "tests/io/temporary_folder.h"

namespace sqslam {
namespace {

using ::testing::HasSubstr;

TEST(TrajectoryFile, ReadsWhatItWrote) {
  const TemporaryFolder folder;
  const Eigen::Quaterniond rotation(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()));
  const Trajectory trajectory = {{1305031102.175304, {rotation, {1.5, -2.25, 0.125}}}, {1305031103.0, {}}};
  WriteTrajectory(folder.Path() / "t.txt", trajectory);
  const Trajectory read = ReadTrajectory(folder.Path() / "t.txt");
  ASSERT_EQ(read.size(), 2u);
  EXPECT_NEAR(read[0].timestamp, trajectory[0].timestamp, 1e-6);
  EXPECT_TRUE(read[0].T_map_camera.translation.isApprox(trajectory[0].T_map_camera.translation, 1e-8));
  EXPECT_LT(read[0].T_map_camera.rotation.angularDistance(rotation), 1e-7);
}

// Poses at 0, 0.5 and 1 s, each in the dialect of another program.
TEST(TrajectoryFile, ReadsDialectsOfOtherPrograms) {
  const TemporaryFolder folder;
  for (const char* text :
       {"0 1 2 3 0 0 0.6 0.8\n0.5 4 5 6 0 0 0 1\n1 7 8 9 0 0 0 1\n",
        "0,1,2,3,0,0,0.6,0.8\r\n0.5,4,5,6,0,0,0,1\r\n1,7,8,9,0,0,0,1\r\n",
        "\xEF\xBB\xBFtimestamp tx ty tz qx qy qz qw\n0 1 2 3 0 0 0.6 0.8\n0.5 4 5 6 0 0 0 1\n1 7 8 9 0 0 0 "
        "1\n",
        "0;1;2;3;0;0;0,6;0,8\n0,5;4;5;6;0;0;0;1\n1;7;8;9;0;0;0;1\n",
        "0 1 2 3 0 0 0.6 0.8 1\n0.5 4 5 6 0 0 0 1 1\n1 7 8 9 0 0 0 1 1\n",
        "#timestamp [s], p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z "
        "[],"
        "v_RS_R_x []\n0,1,2,3,0.8,0,0,0.6,9\n0.5,4,5,6,1,0,0,0,9\n1,7,8,9,1,0,0,0,9\n",
        "secs,pose.orientation.w,pose.orientation.x,pose.orientation.y,pose.orientation.z,x,y,z\n"
        "0,0.8,0,0,0.6,1,2,3\n0.5,1,0,0,0,4,5,6\n1,1,0,0,0,7,8,9\n",
        "0 1 2 3 0 0 0.6 0.8\n0 1 2 3 0 0 0.6 0.8\n0.5 4 5 6 0 0 0 1\n0.75 nan nan nan nan nan nan nan\n"
        "0.8 0 0 0 0 0 0 0\n1 7 8 9 0 0 0 1\n"}) {
    const Trajectory read = ReadTrajectory(folder.Write("t.txt", text));
    ASSERT_EQ(read.size(), 3U) << text;
    EXPECT_EQ(read[1].timestamp, 0.5) << text;
    EXPECT_EQ(read[0].T_map_camera.translation, Eigen::Vector3d(1, 2, 3)) << text;
    EXPECT_TRUE(read[0].T_map_camera.rotation.isApprox(Eigen::Quaterniond(0.8, 0, 0, 0.6), 1e-9)) << text;
  }
}

TEST(TrajectoryFile, CountsSkippedRows) {
  const TemporaryFolder folder;
  const CapturedLog log;
  ReadTrajectory(folder.Write("t.txt", "0 nan nan nan nan nan nan nan\n1 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n"));
  EXPECT_THAT(log.Text(), HasSubstr("t.txt: 1 of 3 rows have no pose"));
  EXPECT_THAT(log.Text(), HasSubstr("t.txt: 1 of 3 rows repeat the time"));
}

TEST(TrajectoryFile, ReportsBrokenLinesByNumber) {
  const TemporaryFolder folder;
  const auto message = [&](const std::string& second) {
    const auto path = folder.Write("t.txt", "1 0 0 0 0 0 0 1\n" + second + "\n");
    return InputErrorOf([&] { ReadTrajectory(path); });
  };
  EXPECT_THAT(message("2 0 0 0 0 0 0"), HasSubstr("t.txt:2:"));
  EXPECT_THAT(message("2 0 0 x 0 0 0 1"), HasSubstr("t.txt:2:"));
  EXPECT_THAT(message("2 0 0 0 0 0 0 2"), HasSubstr("length 1"));
  EXPECT_THAT(message("0.5 0 0 0 0 0 0 1"), HasSubstr("a timestamp after 1.000000"));
}

}  // namespace
}  // namespace sqslam
