#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "slam/tracking/tracker.h"

namespace sqslam {
namespace {

FrameMotion Motion(double angle, const Eigen::Vector3d& translation, std::int64_t frames) {
  const Eigen::Vector3d axis = Eigen::Vector3d(1, -2, 3).normalized();
  return {{Eigen::Quaterniond(Eigen::AngleAxisd(angle, axis)), translation}, frames};
}

TEST(FrameMotion, StaysTheSameOverAsManyFrames) {
  const FrameMotion motion = Motion(0.1, {1, 2, 3}, 4);
  EXPECT_TRUE(motion.Across(4).rotation.coeffs() == motion.T_current_last.rotation.coeffs());
  EXPECT_EQ(motion.Across(4).translation, motion.T_current_last.translation);
}

TEST(FrameMotion, GrowsWithSkippedFrames) {
  for (const double angle : {0.1, -0.4, 0.0}) {
    const Rigid3d one = Motion(angle, {0.1, 0, -0.2}, 1).T_current_last;
    const Rigid3d three = Motion(3 * angle, {0.3, 0, -0.6}, 3).T_current_last;
    const Rigid3d longer = FrameMotion{one, 1}.Across(3);
    const Rigid3d shorter = FrameMotion{three, 3}.Across(1);
    EXPECT_LT(longer.rotation.angularDistance(three.rotation), 1e-7);
    EXPECT_LT(shorter.rotation.angularDistance(one.rotation), 1e-7);
    EXPECT_LT((longer.translation - three.translation).norm(), 1e-12);
    EXPECT_LT((shorter.translation - one.translation).norm(), 1e-12);
  }
}

}  // namespace
}  // namespace sqslam
