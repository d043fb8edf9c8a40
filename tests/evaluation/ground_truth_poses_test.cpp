
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>
#include <opencv2/imgcodecs.hpp>

#include "slam/evaluation/ground_truth.h"
#include "tests/io/temporary_folder.h"

namespace sqslam {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr const char* kCamera = "width: 64\nheight: 48\nfx: 50\nfy: 51\ncx: 32\ncy: 24\nfps: 10\n";
// A quarter turn about z, in rows as 7-Scenes writes them (tabs, three digits in the exponent).
constexpr const char* kQuarterTurn =
    "0.0000000e+000\t-1.0000000e+000\t0.0000000e+000\t1.0000000e+000\t\n"
    "1.0000000e+000\t0.0000000e+000\t0.0000000e+000\t2.0000000e+000\t\n"
    "0.0000000e+000\t0.0000000e+000\t1.0000000e+000\t3.0000000e+000\t\n"
    "0.0000000e+000\t0.0000000e+000\t0.0000000e+000\t1.0000000e+000\t\n";
const Eigen::Vector3d kAlongX(1.0, 0.0, 0.0);
const Eigen::Vector3d kQuarterTurnOfIt(1.0, 3.0, 3.0);

// Every pose has the very time that the reader of images gives its frame.
void ExpectTimesOfFrames(const fs::path& folder, const Trajectory& poses, std::size_t first_frame = 0) {
  const Sequence sequence = OpenSequence({.path = folder});
  ASSERT_EQ(poses.size() + first_frame, sequence.frames.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    EXPECT_EQ(poses[i].timestamp, sequence.frames[i + first_frame].timestamp) << i;
  }
}

TEST(GroundTruthPoses, ReadsSevenScenesMatrices) {
  const TemporaryFolder folder;
  folder.Write("camera.yaml", kCamera);
  for (const std::string frame : {"frame-000009", "frame-000010", "frame-000013"}) {
    folder.Write(frame + ".color.png", "");
    folder.Write(frame + ".depth.png", "");
    folder.Write(frame + ".pose.txt", kQuarterTurn);
  }
  const GroundTruth truth = ReadGroundTruth(folder.Path());
  EXPECT_EQ(truth.frames, 3);
  EXPECT_FALSE(truth.has_objects);
  ExpectTimesOfFrames(folder.Path(), truth.trajectory);
  EXPECT_TRUE((truth.trajectory[1].T_map_camera * kAlongX).isApprox(kQuarterTurnOfIt));
}

TEST(GroundTruthPoses, ReportsBrokenSevenScenesFiles) {
  const TemporaryFolder folder;
  folder.Write("frame-000000.color.png", "");
  const auto message = [&] { return InputErrorOf([&] { ReadGroundTruth(folder.Path()); }); };
  EXPECT_THAT(message(), HasSubstr("expected groundtruth.txt or names like frame-000000.pose.txt"));
  folder.Write("frame-000000.pose.txt", "1 0 0 0\n0 1 0 0\n0 0 1 0\n");
  EXPECT_THAT(message(), AllOf(HasSubstr("frame-000000.pose.txt: 3 lines"), HasSubstr("four rows")));
  folder.Write("frame-000000.pose.txt", "1 0 0 0\n0 1 0 nan\n0 0 1 0\n0 0 0 1\n");
  EXPECT_THAT(message(), HasSubstr("frame-000000.pose.txt:2: '0 1 0 nan'"));
  folder.Write("frame-000000.pose.txt", "1 0 0 0\n0 1 0 0\n0 0 -1 0\n0 0 0 1\n");
  EXPECT_THAT(message(), HasSubstr("is not a rotation"));
  folder.Write("frame-000000.pose.txt", "1 0 0 0\n0 1 0 0\n0 0 1 0\n1 2 3 1\n");
  EXPECT_THAT(message(), HasSubstr("frame-000000.pose.txt:4"));
}

TEST(GroundTruthPoses, ReadsScenesV2PosesBesideImages) {
  const TemporaryFolder folder;
  const fs::path scene = folder.Path() / "imgs" / "scene_07";
  for (const char* name : {"00000-color.png", "00001-color.png", "00000-depth.png"}) {
    folder.Write("imgs/scene_07/" + std::string(name), "");
  }
  folder.Write("pc/06.pose", "1 0 0 0 9 9 9\n");
  folder.Write("pc/07.pose", "1 0 0 0 0 0 0\n0.70710678 0 0 0.70710678 1 2 3\n");  // qw first
  for (const fs::path& named : {scene, scene / ""}) {
    const GroundTruth truth = ReadGroundTruth(named);
    EXPECT_EQ(truth.frames, 2);
    ExpectTimesOfFrames(scene, truth.trajectory);
    EXPECT_TRUE((truth.trajectory[1].T_map_camera * kAlongX).isApprox(kQuarterTurnOfIt, 1e-7));
  }
}

TEST(GroundTruthPoses, NamesExpectedScenesV2File) {
  const TemporaryFolder folder;
  const fs::path scene = folder.Path() / "imgs" / "scene_07";
  folder.Write("imgs/scene_07/00000-color.png", "");
  const auto message = [&] { return InputErrorOf([&] { ReadGroundTruth(scene); }); };
  EXPECT_THAT(message(), AllOf(HasSubstr("pc/07.pose"), HasSubstr("or a single *.pose here")));
  folder.Write("imgs/scene_07/07.pose", "1 0 0 0 0 0\n");
  EXPECT_THAT(message(), HasSubstr("07.pose:1: '1 0 0 0 0 0', expected 'qw qx qy qz x y z'"));
  folder.Write("imgs/scene_07/07.pose", "1 0 0 0 0 0 0\n0.1 0.2 0.3 1 1 1 1\n1 1 1 1 0 0 0\n");
  EXPECT_THAT(message(), HasSubstr("07.pose:2"));
}

TEST(GroundTruthPoses, CountsIclNuimFramesLikeImages) {
  const TemporaryFolder folder;
  folder.Write("camera.yaml", kCamera);
  for (const char* name : {"rgb/0.png", "rgb/1.png", "rgb/2.png"}) {
    folder.Write(name, "");
  }
  // As published: the first image has no pose.
  const fs::path poses = folder.Write("livingRoom2.gt.freiburg", "1 0 0 -2.25 0 0 0 1\n2 1 2 3 0 0 0 1\n");
  const GroundTruth truth = ReadGroundTruth(folder.Path());
  EXPECT_EQ(truth.frames, 3);
  ExpectTimesOfFrames(folder.Path(), truth.trajectory, 1);
  EXPECT_EQ(truth.trajectory[1].T_map_camera.translation, Eigen::Vector3d(1.0, -2.0, 3.0));

  folder.Write("livingRoom2.gt.freiburg", "0.033 0 0 -2.25 0 0 0 1\n");
  EXPECT_THAT(InputErrorOf([&] { ReadGroundTruth(folder.Path()); }),
              AllOf(HasSubstr("livingRoom2.gt.freiburg"), HasSubstr("expected frame numbers")));
  folder.Write("traj0.gt.freiburg", "1 0 0 -2.25 0 0 0 1\n");
  EXPECT_THAT(InputErrorOf([&] { ReadGroundTruth(folder.Path()); }), HasSubstr("2 files of ground-truth"));
}

TEST(GroundTruthPoses, PrefersGroundtruthFile) {
  const TemporaryFolder folder;
  folder.Write("frame-000000.color.png", "");
  folder.Write("frame-000000.pose.txt", "no matrix");
  folder.Write("groundtruth.txt", "0.0 1 2 3 0 0 0 1\n");
  EXPECT_EQ(ReadGroundTruth(folder.Path()).trajectory.at(0).T_map_camera.translation.y(), 2.0);
}

TEST(GroundTruthPoses, ReadsGroundtruthFileOfPlainImages) {
  const TemporaryFolder folder;
  folder.Write("a.png", "");
  EXPECT_THAT(InputErrorOf([&] { ReadGroundTruth(folder.Path()); }), HasSubstr("groundtruth.txt"));
  folder.Write("groundtruth.txt", "0.0 1 2 3 0 0 0 1\n");
  EXPECT_EQ(ReadGroundTruth(folder.Path()).frames, 1);
}

// The camera that ICL-NUIM publishes: fx 481.20, fy -480.00, cx 319.50, cy 239.50 and T_world_camera.
Eigen::Vector2d PixelAsPublished(const Rigid3d& published, const Eigen::Vector3d& p_world) {
  const Eigen::Vector3d p = published.Inverse() * p_world;
  return {481.20 * p.x() / p.z() + 319.50, -480.00 * p.y() / p.z() + 239.50};
}

// The nearest approach of two rays, from two poses of a camera with fy = +480: their distance there and the
// depths along both.
struct RayMeeting {
  double gap = 0.0;
  double depth_a = 0.0;
  double depth_b = 0.0;
};
RayMeeting Meet(const Rigid3d& a, const Eigen::Vector2d& pixel_a, const Rigid3d& b,
                const Eigen::Vector2d& pixel_b) {
  Camera camera;
  camera.fx = 481.20;
  camera.fy = 480.00;
  camera.cx = 319.50;
  camera.cy = 239.50;
  Eigen::Matrix<double, 3, 2> rays;
  rays.col(0) = a.rotation * camera.Unproject(pixel_a);
  rays.col(1) = -(b.rotation * camera.Unproject(pixel_b));
  const Eigen::Vector3d base = b.translation - a.translation;
  const Eigen::Vector2d depths = (rays.transpose() * rays).ldlt().solve(rays.transpose() * base);
  return {(rays * depths - base).norm(), depths.x(), depths.y()};
}

// The images are made by the published camera, with y up, from the published poses. The poses as read must be
// those of a camera with y down that has taken the same images: the rays of one point through its pixels meet
// in front of both cameras. With the published poses, a camera with y down has rays that miss each other.
TEST(GroundTruthPoses, ConvertsIclNuimPosesToCamera) {
  const TemporaryFolder folder;
  folder.Write("rgb/1.png", "");
  folder.Write("rgb/2.png", "");
  const fs::path file = folder.Write("livingRoom0.gt.freiburg",
                                     "1 0.1 0.2 -2.25 0.0 0.0 0.0 1.0\n"
                                     "2 0.5 0.7 -2.0 0.10 -0.15 0.05 0.98234413\n");
  const Trajectory published = ReadTrajectory(file);
  const Trajectory read = ReadGroundTruth(folder.Path()).trajectory;
  double worst_as_published = 0.0;
  for (const Eigen::Vector3d& p_world :
       {Eigen::Vector3d(0.3, 0.4, 1.0), Eigen::Vector3d(-0.6, 0.9, 1.5), Eigen::Vector3d(0.2, -0.8, 0.7)}) {
    const Eigen::Vector2d pixel_a = PixelAsPublished(published[0].T_map_camera, p_world);
    const Eigen::Vector2d pixel_b = PixelAsPublished(published[1].T_map_camera, p_world);
    const RayMeeting meeting = Meet(read[0].T_map_camera, pixel_a, read[1].T_map_camera, pixel_b);
    EXPECT_LT(meeting.gap, 1e-6);
    EXPECT_GT(meeting.depth_a, 0.5);
    EXPECT_GT(meeting.depth_b, 0.5);
    const RayMeeting without = Meet(published[0].T_map_camera, pixel_a, published[1].T_map_camera, pixel_b);
    worst_as_published = std::max(worst_as_published, without.gap);
  }
  EXPECT_GT(worst_as_published, 0.1);  // the test can fail
}

// In the image as shown, a camera that rises (published y grows) sees things move down.
TEST(GroundTruthPoses, MirrorsIclNuimY) {
  const Rigid3d low = MirrorIclNuim({Eigen::Quaterniond::Identity(), {0.0, 1.0, 0.0}});
  const Rigid3d high = MirrorIclNuim({Eigen::Quaterniond::Identity(), {0.0, 1.5, 0.0}});
  EXPECT_LT(high.translation.y(), low.translation.y());
  // Looking up: the published quaternion turns z towards +y, the one read towards -y, which is up there.
  const double s = std::sin(-std::numbers::pi / 8.0);
  const Rigid3d up = MirrorIclNuim({Eigen::Quaterniond(std::cos(std::numbers::pi / 8.0), s, 0.0, 0.0), {}});
  const Eigen::Vector3d published_axis =
      Eigen::Quaterniond(std::cos(std::numbers::pi / 8.0), s, 0.0, 0.0) * Eigen::Vector3d::UnitZ();
  EXPECT_GT(published_axis.y(), 0.5);
  EXPECT_NEAR((up.rotation * Eigen::Vector3d::UnitZ()).y(), -published_axis.y(), 1e-12);
}

TEST(GroundTruthPoses, ConvertsEurocBodyPosesToCamera) {
  const TemporaryFolder folder;
  const fs::path mav = folder.Path() / "mav0";
  folder.Write("mav0/cam0/data.csv", "#timestamp [ns],filename\n1403636579763555584,a.png\n");
  folder.Write("mav0/cam0/data/a.png", "");
  const std::string camera =
      "rate_hz: 20\nresolution: [752, 480]\nintrinsics: [458.6, 457.3, 367.2, 248.4]\n";
  folder.Write("mav0/cam0/sensor.yaml", camera +
                                            "T_BS:\n  cols: 4\n  rows: 4\n"
                                            "  data: [0, -1, 0, 0.5, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n");
  const std::string header = "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], ...\n";
  const std::string truth = "mav0/state_groundtruth_estimate0/data.csv";
  folder.Write(truth, header +
                          "1403636579763555584,1.0,2.0,3.0,1,0,0,0,9,9,9\n"
                          "1403636579768555584, 1.0, 2.0, 4.0, 0, 1, 0, 0, 9, 9, 9\r\n");
  for (const fs::path& below : {folder.Path(), mav, mav / "cam0"}) {
    const Trajectory poses = ReadTruePoses(below);
    ASSERT_EQ(poses.size(), 2U);
    EXPECT_DOUBLE_EQ(poses[0].timestamp, OpenSequence({.path = below}).frames[0].timestamp);
    EXPECT_TRUE((poses[0].T_map_camera * kAlongX).isApprox(Eigen::Vector3d(1.5, 3.0, 3.0)));
    EXPECT_TRUE((poses[1].T_map_camera * kAlongX).isApprox(Eigen::Vector3d(1.5, 1.0, 4.0)));
  }
  const auto message = [&] { return InputErrorOf([&] { ReadTruePoses(folder.Path()); }); };
  folder.Write(truth, header + "1403636579763555584,1.0,2.0\n");
  EXPECT_THAT(message(), AllOf(HasSubstr("data.csv:2: "), HasSubstr("'timestamp in ns,x,y,z,qw,qx,qy,qz")));
  folder.Write(truth, header + "1403636579763555584,1,2,3,1,1,0,0\n");
  EXPECT_THAT(message(), HasSubstr("data.csv:2: "));
  folder.Write("mav0/cam0/sensor.yaml", camera);
  EXPECT_THAT(message(),
              HasSubstr("sensor.yaml: T_BS is missing or not a rigid motion, expected the 16 numbers"));
  fs::remove_all(mav / "state_groundtruth_estimate0");
  EXPECT_THAT(message(), HasSubstr("state_groundtruth_estimate0"));
}

TEST(GroundTruthPoses, ConvertsKittiPosesToChosenCamera) {
  const TemporaryFolder folder;
  const fs::path sequence = folder.Path() / "sequences/07";
  folder.Write("sequences/07/times.txt", "0.0\n0.1037\n");
  folder.Write("sequences/07/calib.txt",
               "P0: 700 0 600 0 0 700 180 0 0 0 1 0\nP2: 700 0 600 48 0 700 180 1.8 0 0 1 0.01\n");
  fs::create_directories(sequence / "image_2");
  for (const char* name : {"000000.png", "000001.png"}) {
    cv::imwrite((sequence / "image_2" / name).string(), cv::Mat(96, 128, CV_8UC3));
  }
  folder.Write("poses/07.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n0 -1 0 1 1 0 0 2 0 0 1 3\n");
  const Trajectory poses = ReadTruePoses(sequence);
  ExpectTimesOfFrames(sequence, poses);
  // K^-1 (48, 1.8, 0.01): the camera is 6 cm to the left of camera 0 and 1 cm behind it.
  EXPECT_TRUE(poses[0].T_map_camera.translation.isApprox(Eigen::Vector3d(-0.06, 0.0, -0.01), 1e-9));
  EXPECT_TRUE(poses[1].T_map_camera.translation.isApprox(Eigen::Vector3d(1.0, 1.94, 2.99), 1e-9));
  EXPECT_TRUE(ReadTruePoses(sequence / "")
                  .front()
                  .T_map_camera.translation.isApprox(poses[0].T_map_camera.translation));
  const auto message = [&] { return InputErrorOf([&] { ReadTruePoses(sequence); }); };
  folder.Write("poses/07.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n");
  EXPECT_THAT(message(), HasSubstr("07.txt: 1 lines for 2 frames"));
  folder.Write("poses/07.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0 0 1 0 0 0 0 1\n");
  EXPECT_THAT(message(), HasSubstr("07.txt:2: "));
  folder.Write("poses/07.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n2 0 0 0 0 1 0 0 0 0 1 0\n");
  EXPECT_THAT(message(), HasSubstr("expected a pose whose first three columns are a rotation"));
  fs::remove(folder.Path() / "poses/07.txt");
  EXPECT_THAT(message(), HasSubstr("poses/07.txt"));
}

}  // namespace
}  // namespace sqslam
