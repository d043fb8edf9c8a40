#include "slam/evaluation/trajectory_error.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace sqslam {
namespace {

using Eigen::Vector3d;
using testing::ElementsAre;
using testing::Pair;

Trajectory At(const std::vector<double>& times) {
  Trajectory trajectory;
  for (const double t : times) {
    trajectory.push_back({t, {Eigen::Quaterniond::Identity(), {std::cos(t), std::sin(t), 0.1 * t}}});
  }
  return trajectory;
}

TEST(AssociateByTime, TakesNearestWithinLimitOnce) {
  const auto pairs = AssociateByTime(At({0.0, 0.009, 0.1, 0.25, 0.31}), At({0.01, 0.1, 0.2, 0.3}), 0.02);
  EXPECT_THAT(pairs, ElementsAre(Pair(1, 0), Pair(2, 1), Pair(4, 3)));
  EXPECT_TRUE(AssociateByTime({}, At({1.0}), 0.02).empty());
  EXPECT_TRUE(AssociateByTime(At({1.0}), {}, 0.02).empty());
}

TEST(TrajectoryError, IgnoresFrameAndScaleOfMap) {
  const Trajectory truth = At({0, 0.5, 1, 1.5, 2, 2.5, 3});
  const Sim3d S{2.5, Eigen::Quaterniond(Eigen::AngleAxisd(0.8, Vector3d(1, 1, 0).normalized())), {3, 2, 1}};
  Trajectory estimated = truth;
  for (TimedPose& pose : estimated) {
    pose.T_map_camera.translation = S * pose.T_map_camera.translation;
  }
  const auto error = ComputeTrajectoryError(estimated, truth, 0.02);
  ASSERT_TRUE(error.has_value());
  EXPECT_EQ(error->pairs, 7);
  EXPECT_NEAR(error->rmse, 0.0, 1e-12);
  EXPECT_NEAR(error->S_world_map.scale, 1 / 2.5, 1e-12);
}

TEST(TrajectoryError, DoesNotDependOnAlignment) {
  const Trajectory truth = At({0, 0.1, 0.2, 0.3, 0.4});
  Trajectory estimated = truth;
  estimated[2].T_map_camera.translation.z() += 0.01;
  const auto by_positions = ComputeTrajectoryError(estimated, truth, 0.02, Alignment::kPositions);
  const auto by_poses = ComputeTrajectoryError(estimated, truth, 0.02, Alignment::kPoses);
  ASSERT_TRUE(by_positions && by_poses);
  EXPECT_EQ(by_poses->rmse, by_positions->rmse);
  EXPECT_GT(by_positions->S_world_map.rotation.angularDistance(Eigen::Quaterniond::Identity()), 1e-3);
  EXPECT_LT(by_poses->S_world_map.rotation.angularDistance(Eigen::Quaterniond::Identity()), 1e-6);
}

TEST(TrajectoryError, MeasuresNoiseAndTruePathLength) {
  std::vector<double> times;
  for (int i = 0; i < 2000; ++i) {
    times.push_back(i * 0.005);
  }
  const Trajectory truth = At(times);
  Trajectory estimated = truth;
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0.0, 0.01);
  for (TimedPose& pose : estimated) {
    pose.T_map_camera.translation += Vector3d(noise(random), noise(random), noise(random));
  }
  const auto error = ComputeTrajectoryError(estimated, truth, 0.02);
  ASSERT_TRUE(error.has_value());
  EXPECT_NEAR(error->rmse, 0.01 * std::sqrt(3.0), 0.0005);
  EXPECT_GE(error->max, error->rmse);
  EXPECT_NEAR(error->path_length, std::sqrt(1.01) * times.back(), 1e-3);  // a helix
}

TEST(TrajectoryError, ReturnsNothingForFewOrCollinearPoses) {
  EXPECT_FALSE(ComputeTrajectoryError(At({0, 1}), At({0, 1}), 0.02).has_value());
  Trajectory line = At({0, 1, 2, 3});
  for (TimedPose& pose : line) {
    pose.T_map_camera.translation = {pose.timestamp, 0, 0};
  }
  EXPECT_FALSE(ComputeTrajectoryError(line, At({0, 1, 2, 3}), 0.02).has_value());
  EXPECT_FALSE(ComputeTrajectoryError(At({0, 1, 2}), At({10, 11, 12}), 0.02).has_value());
}

}  // namespace
}  // namespace sqslam
