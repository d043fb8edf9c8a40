#include "slam/map/anchored_pose.h"

#include <gtest/gtest.h>

#include <optional>

namespace sqslam {
namespace {

// A keyframe one unit of length beside its reference.
RemovedKeyframe Beside(KeyframeId reference) {
  return {{reference, {{1, 0, 0, 0}, {1.0, 0.0, 0.0}}, 1.0}, 1.0};
}

TEST(RemovedKeyframes, ResolvesLongChainToPresentKeyframe) {
  constexpr KeyframeId kLast = 100000;
  RemovedKeyframes removed;
  for (KeyframeId id = 1; id <= kLast; ++id) {
    removed[id] = Beside(id - 1);
  }
  const auto present = [](KeyframeId id) {
    return id == 0 ? std::optional(ScaledPose{{}, 2.0}) : std::nullopt;
  };
  const ScaledPose pose = PoseOf(removed, kLast, present);
  EXPECT_NEAR(pose.T_camera_map.translation.x(), 2.0 * kLast, 1e-6) << "in units that have doubled since";
  EXPECT_EQ(pose.scale, 2.0);
}

}  // namespace
}  // namespace sqslam
