#include <gtest/gtest.h>

#include <cmath>

#include "slam/evaluation/trajectory_error.h"
#include "slam/geometry/rigid3.h"

namespace sqslam {
namespace {

// A true path of 101 poses over 10 s, and a map of it in another frame and scale with a keyframe a second.
struct Drive {
  Trajectory truth;
  MapSnapshot map;
  Sim3d S_world_map{2.5,
                    Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1.0, 2.0, 3.0).normalized())),
                    {1.0, -2.0, 0.5}};
};

Drive MakeDrive() {
  Drive drive;
  const Sim3d S_map_world = drive.S_world_map.Inverse();
  for (int i = 0; i <= 100; ++i) {
    const double t = 0.1 * i;
    const Eigen::Vector3d p(std::cos(0.5 * t), std::sin(0.5 * t), 0.1 * t);
    drive.truth.push_back({t, {Eigen::Quaterniond::Identity(), p}});
    if (i % 10 == 0) {
      const Rigid3d pose{S_map_world.rotation, S_map_world * p};
      drive.map.keyframes.push_back({i / 10, i, t, pose});
    }
  }
  drive.map.timestamp = 10.0;
  return drive;
}

TEST(TruePathTest, PassesThroughKeyframesOfExactMap) {
  const Drive drive = MakeDrive();
  const auto path = AlignTruePath(drive.truth, drive.map);
  ASSERT_TRUE(path);
  EXPECT_EQ(path->pairs, 11);
  EXPECT_LT(path->rmse, 1e-9);
  EXPECT_NEAR(path->S_world_map.scale, 2.5, 1e-9);
  ASSERT_EQ(path->pieces.size(), 1u);
  ASSERT_EQ(path->pieces[0].size(), 101u);
  for (const SnapshotKeyframe& keyframe : drive.map.keyframes) {
    const Eigen::Vector3d there = path->pieces[0][static_cast<std::size_t>(keyframe.frame_index)];
    EXPECT_LT((there - keyframe.T_map_camera.translation).norm(), 1e-9);
  }
}

TEST(TruePathTest, EndsWithMapAndSplitsAtMissingPoses) {
  Drive drive = MakeDrive();
  drive.map.keyframes.resize(7);  // until 6 s
  drive.map.timestamp = 6.5;
  drive.truth.erase(drive.truth.begin() + 31, drive.truth.begin() + 40);
  const auto path = AlignTruePath(drive.truth, drive.map);
  ASSERT_TRUE(path);
  ASSERT_EQ(path->pieces.size(), 2u);
  EXPECT_EQ(path->pieces[0].size(), 31u);
  EXPECT_EQ(path->pieces[1].size(), 26u);
}

TEST(TruePathTest, IgnoresOrderOfKeyframes) {
  Drive drive = MakeDrive();
  std::swap(drive.map.keyframes[2], drive.map.keyframes[8]);  // maps that became one
  const auto path = AlignTruePath(drive.truth, drive.map);
  ASSERT_TRUE(path);
  EXPECT_EQ(path->pairs, 11);
  EXPECT_LT(path->rmse, 1e-9);
}

TEST(TruePathTest, ReportsErrorOfKeyframes) {
  Drive drive = MakeDrive();
  for (std::size_t i = 0; i < drive.map.keyframes.size(); ++i) {
    drive.map.keyframes[i].T_map_camera.translation.z() += i % 2 == 0 ? 0.004 : -0.004;
  }
  const auto path = AlignTruePath(drive.truth, drive.map);
  ASSERT_TRUE(path);
  EXPECT_NEAR(path->rmse, 0.01, 0.001);  // metres: 2.5 a map unit
}

TEST(TruePathTest, RequiresThreeCommonPoses) {
  Drive drive = MakeDrive();
  drive.map.keyframes.resize(2);
  EXPECT_FALSE(AlignTruePath(drive.truth, drive.map).has_value());
  EXPECT_FALSE(AlignTruePath({}, MakeDrive().map).has_value());
}

}  // namespace
}  // namespace sqslam
