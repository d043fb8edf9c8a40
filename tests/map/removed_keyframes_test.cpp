#include "slam/map/removed_keyframes.h"

#include <gtest/gtest.h>

#include <optional>

namespace sqslam {
namespace {

// A keyframe one unit of length beside its reference.
RemovedKeyframe Beside(KeyframeId reference) {
  return {{reference, {{1, 0, 0, 0}, {1.0, 0.0, 0.0}}, 1.0}, 1.0};
}

TEST(RemovedKeyframes, AreFoundByIdWhateverTheOrderTheyWereRemovedIn) {
  RemovedKeyframes removed;
  for (const KeyframeId id : {700, 3, 64, 63, 200}) {
    removed.Add(id, Beside(id - 1));
  }
  EXPECT_EQ(removed.Size(), 5);
  EXPECT_EQ(removed.IdBound(), 701);
  EXPECT_EQ(removed.At(64).pose.reference, 63);
  EXPECT_FALSE(removed.Contains(65));
  EXPECT_THROW(removed.At(65), std::out_of_range);
  EXPECT_EQ(removed.All().size(), 5U);
  EXPECT_EQ(removed.All().begin()->first, 3);
}

TEST(RemovedKeyframes, ACopyKnowsOnlyThoseOfItsTime) {
  RemovedKeyframes removed;
  removed.Add(1, Beside(0));
  const RemovedKeyframes copy = removed;
  removed.Add(2, Beside(0));
  removed.Add(100, Beside(0));
  EXPECT_EQ(copy.Size(), 1);
  EXPECT_FALSE(copy.Contains(2));
  EXPECT_TRUE(removed.Contains(2));
}

TEST(RemovedKeyframes, FollowAChainOfAnyLengthToAKeyframeThatIsThere) {
  constexpr KeyframeId kLast = 100000;
  RemovedKeyframes removed;
  for (KeyframeId id = 1; id <= kLast; ++id) {
    removed.Add(id, Beside(id - 1));
  }
  const auto present = [](KeyframeId id) {
    return id == 0 ? std::optional(ScaledPose{{}, 2.0}) : std::nullopt;
  };
  const ScaledPose pose = removed.PoseOf(kLast, present);
  EXPECT_NEAR(pose.T_camera_map.translation.x(), 2.0 * kLast, 1e-6) << "in units that have doubled since";
  EXPECT_EQ(pose.scale, 2.0);
}

}  // namespace
}  // namespace sqslam
