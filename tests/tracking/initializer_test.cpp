#include "slam/tracking/initializer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/synthetic_map.h"

namespace sqslam {
namespace {

using testing::CountBrokenReferences;
using ::testing::HasSubstr;
using testing::LargestReprojectionError;
using testing::MakeSyntheticMap;
using testing::PoseOnArc;
using testing::Sight;
using testing::SyntheticWorld;
using testing::Turn;

class InitializerTest : public ::testing::Test {
 protected:
  std::unique_ptr<Map> Add(std::int64_t index, const Rigid3d& T_camera_world, const Sight& sight = {}) {
    return initializer_.Add(index, static_cast<double>(index) / 30.0,
                            world_.See(T_camera_world, sight).features);
  }
  std::unique_ptr<Map> Start(const Sight& first, const Sight& second) {
    EXPECT_EQ(Add(0, PoseOnArc(0), first), nullptr);
    return Add(1, PoseOnArc(1), second);
  }

  // Checks poses and points against the truth in the frame and with the unit of the first keyframe.
  void ExpectTruth(const Map& map, double tolerance) const {
    ASSERT_EQ(map.Keyframes().size(), 2U);
    const Keyframe& first = map.Keyframes().begin()->second;
    const Keyframe& second = map.Keyframes().rbegin()->second;
    EXPECT_TRUE(first.T_camera_map.Matrix().isIdentity());
    const Rigid3d T_second_first = PoseOnArc(1) * PoseOnArc(0).Inverse();
    const double unit = T_second_first.translation.norm() / second.T_camera_map.translation.norm();
    EXPECT_LT(second.T_camera_map.rotation.angularDistance(T_second_first.rotation), tolerance);
    EXPECT_LT((unit * second.T_camera_map.translation - T_second_first.translation).norm(),
              tolerance * T_second_first.translation.norm());
    std::vector<double> errors;
    for (const MapPoint& point : map.Points()) {
      const auto index = static_cast<std::size_t>(point.observations.front().keypoint);
      errors.push_back((unit * point.p_map - PoseOnArc(0) * world_.points[index]).norm());
    }
    std::sort(errors.begin(), errors.end());
    EXPECT_LT(errors[errors.size() * 9 / 10], 4.0 * tolerance);
  }

  SyntheticWorld world_ = MakeSyntheticMap({});
  Initializer initializer_{world_.camera, {}, ScaleLevels(OrbOptions{})};
};

TEST_F(InitializerTest, RecoversPoseAndPointsUpToScale) {
  const auto map = Start({}, {});
  ASSERT_NE(map, nullptr) << initializer_.Reason();
  ExpectTruth(*map, 1e-3);
  EXPECT_GT(map->NumPoints(), 280);
  EXPECT_EQ(CountBrokenReferences(*map), 0);
  EXPECT_EQ(map->Keyframes().begin()->second.covisibility.size(), 1U);
}

TEST_F(InitializerTest, RecoversPoseAndPointsFromNoisyClutter) {
  const auto map = Start({.pixel_noise = 0.4, .flipped_bits = 10, .clutter = 80, .seed = 1},
                         {.pixel_noise = 0.4, .flipped_bits = 10, .clutter = 80, .seed = 2});
  ASSERT_NE(map, nullptr) << initializer_.Reason();
  ExpectTruth(*map, 0.05);
}

TEST_F(InitializerTest, RejectsMismatches) {
  // A tenth of the descriptors stand at each other's keypoints, some 50 px away.
  FrameFeatures features = *world_.See(PoseOnArc(1)).features;
  for (std::size_t i = 0; i + 20 < features.Size(); i += 20) {
    std::swap(features.descriptors[i], features.descriptors[i + 1]);
  }
  EXPECT_EQ(Add(0, PoseOnArc(0)), nullptr);
  const auto map = initializer_.Add(1, 0.1, std::make_shared<const FrameFeatures>(features));
  ASSERT_NE(map, nullptr) << initializer_.Reason();
  EXPECT_LT(LargestReprojectionError(*map, world_.camera), 2.5);
  ExpectTruth(*map, 0.01);
}

TEST_F(InitializerTest, SetsMedianDepthToOne) {
  const auto map = Start({}, {});
  ASSERT_NE(map, nullptr);
  std::vector<double> depths;
  for (const MapPoint& point : map->Points()) {
    depths.push_back(point.p_map.z());
    // Distance range and normal belong to the scaled point.
    EXPECT_NEAR(point.level_zero_distance, point.p_map.norm(), 1e-9);
  }
  std::nth_element(depths.begin(), depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2),
                   depths.end());
  EXPECT_NEAR(depths[depths.size() / 2], 1.0, 1e-9);
  EXPECT_LT(LargestReprojectionError(*map, world_.camera), 1e-3);
}

TEST_F(InitializerTest, RejectsPureRotation) {
  for (int i = 0; i < 20; ++i) {
    const Rigid3d turn = Turn(0.015 * i, Eigen::Vector3d(0.3, 1.0, 0.2));
    EXPECT_EQ(Add(i, turn * PoseOnArc(0), {.pixel_noise = 0.4, .seed = static_cast<std::uint64_t>(i)}),
              nullptr);
  }
  EXPECT_THAT(initializer_.Reason(), HasSubstr("must translate"));
}

TEST_F(InitializerTest, RejectsStaticCamera) {
  for (int i = 0; i < 20; ++i) {
    EXPECT_EQ(Add(i, PoseOnArc(0), {.pixel_noise = 0.4, .seed = static_cast<std::uint64_t>(i)}), nullptr);
  }
  EXPECT_THAT(initializer_.Reason(), HasSubstr("hardly moves"));
}

TEST_F(InitializerTest, RejectsTooLittleTexture) {
  world_.points.resize(60);
  EXPECT_EQ(Start({}, {}), nullptr);
  EXPECT_THAT(initializer_.Reason(), HasSubstr("60 features, at least 100 needed"));
}

TEST_F(InitializerTest, RestartsWhenFramesHaveNothingInCommon) {
  SyntheticWorld elsewhere = MakeSyntheticMap({.seed = 99});
  EXPECT_EQ(initializer_.Add(0, 0.0, elsewhere.See(PoseOnArc(0)).features), nullptr);
  EXPECT_EQ(Add(1, PoseOnArc(0)), nullptr);
  EXPECT_THAT(initializer_.Reason(), HasSubstr("too few matches"));
  const auto map = Add(2, PoseOnArc(1));
  ASSERT_NE(map, nullptr);
  EXPECT_EQ(map->Keyframes().begin()->second.frame_index, 1);
}

TEST_F(InitializerTest, ReplacesFirstFrameThatMovedForMaxFrames) {
  const Rigid3d turn = Turn(0.1, Eigen::Vector3d::UnitX());
  EXPECT_EQ(Add(0, PoseOnArc(0)), nullptr);
  EXPECT_EQ(Add(Initializer::kMaxFrames + 1, turn * PoseOnArc(0)), nullptr);
  const auto map = Add(100, turn * PoseOnArc(1));
  ASSERT_NE(map, nullptr);
  EXPECT_EQ(map->Keyframes().begin()->second.frame_index, Initializer::kMaxFrames + 1);
}

TEST_F(InitializerTest, WaitsForSlowCamera) {
  EXPECT_EQ(Add(0, PoseOnArc(0)), nullptr);
  EXPECT_EQ(Add(10 * Initializer::kMaxFrames, PoseOnArc(0)), nullptr);
  const auto map = Add(10 * Initializer::kMaxFrames + 1, PoseOnArc(1));
  ASSERT_NE(map, nullptr);
  EXPECT_EQ(map->Keyframes().begin()->second.frame_index, 0);
}

TEST_F(InitializerTest, FollowsKeypointsBeyondSearchRadius) {
  // 25 px from frame to frame, 200 px from the first to the last: found because each search begins where the
  // keypoint was seen last. Too little translation to end earlier.
  EXPECT_EQ(Add(0, PoseOnArc(0)), nullptr);
  std::unique_ptr<Map> map;
  for (int i = 1; i <= 8; ++i) {
    const Rigid3d turn = Turn(0.05 * i, Eigen::Vector3d::UnitX());
    map = Add(i, turn * (i < 8 ? PoseOnArc(0) : PoseOnArc(1)));
    EXPECT_EQ(map != nullptr, i == 8) << i << ' ' << initializer_.Reason();
  }
}

TEST_F(InitializerTest, DropsFirstFrameWhenReset) {
  EXPECT_EQ(Add(0, PoseOnArc(0)), nullptr);
  initializer_.Reset();
  EXPECT_EQ(Add(1, PoseOnArc(1)), nullptr);
  const auto map = Add(2, PoseOnArc(2));
  ASSERT_NE(map, nullptr);
  EXPECT_EQ(map->Keyframes().begin()->second.frame_index, 1);
}

TEST_F(InitializerTest, TakesIdsFromSharedSource) {
  const auto ids = std::make_shared<IdSource>();
  ids->next_keyframe = 40;
  ids->next_point = 4000;
  initializer_ = Initializer(world_.camera, {}, ScaleLevels(OrbOptions{}), ids);
  const auto map = Start({}, {});
  ASSERT_NE(map, nullptr);
  EXPECT_EQ(map->OldestKeyframe(), 40);
  EXPECT_EQ(map->NewestKeyframe(), 41);
  EXPECT_GE((*map->Points().begin()).id, 4000);
}

}  // namespace
}  // namespace sqslam
