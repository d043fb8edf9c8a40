#include <gtest/gtest.h>

#include "slam/mapping/mapper.h"
#include "tests/mapping/mapper_fixture.h"
#include "tests/support/synthetic_map.h"

namespace sqslam {
namespace {

using testing::CenterDistance;
using testing::CenterError;
using testing::ExactRing;
using testing::MakeRingMap;
using testing::MapperWithWords;
using testing::RandomWords;
using testing::RingMapOptions;
using testing::SyntheticMap;

// Eight keyframes, from 100 on, that stand where the first eight of ExactRing() do.
Map BeginningOfTheRingAgain() {
  RingMapOptions later = ExactRing();
  later.first_id = 100;
  later.keyframes = 8;
  return MakeRingMap(later).map;
}

TEST_F(MapperWithWords, ClosesLoop) {
  SyntheticMap ring = MakeRingMap({});
  const double before = CenterError(ring);
  mapper_->Process(Beginning(0, ring.map));
  EXPECT_EQ(mapper_->Counters().loops, 1);
  EXPECT_EQ(mapper_->Counters().merges, 0);
  for (const auto& [id, keyframe] : View().keyframes) {
    ring.map.At(id).T_camera_map = keyframe.pose.T_camera_map;
  }
  for (const auto& [id, removed] : View().removed) {
    ring.map.At(id).T_camera_map = View().PoseOf(id).T_camera_map;
  }
  EXPECT_LT(CenterError(ring), before / 5.0);
}

// The second submap sees what the first one knows, in a frame and unit of its own.
TEST_F(MapperWithWords, MergesSubmapsOfOnePlace) {
  mapper_->Process(Beginning(0, MakeRingMap(ExactRing()).map));
  EXPECT_EQ(mapper_->Counters().loops, 1) << "where the ring itself closes";
  Map map = BeginningOfTheRingAgain();
  const Sim3d S_1_0{2.5,
                    Eigen::Quaterniond(Eigen::AngleAxisd(0.8, Eigen::Vector3d(1.0, 2.0, 3.0).normalized())),
                    {3.0, -1.0, 7.0}};
  map.Transform(S_1_0);
  mapper_->Process(Beginning(1, std::move(map)));
  EXPECT_EQ(mapper_->Counters().merges, 1);
  EXPECT_EQ(atlas_->submaps.size(), 1U);
  const AtlasView::Origin& origin = atlas_->origins.at(1);
  EXPECT_EQ(origin.submap, 0);
  // It lies where it should, in the unit of the first.
  EXPECT_NEAR(origin.S_map_origin.scale * S_1_0.scale, 1.0, 0.01);
  EXPECT_LT(CenterDistance(View().PoseOf(103).T_camera_map, testing::PoseOnRing(45.0)), 0.01);
  ASSERT_EQ(mapper_->Finish().size(), 1U);
}

// Two maps have two spanning trees. The younger one hangs where the maps meet, rooted there.
TEST_F(MapperWithWords, KeepsOneSpanningTreeWhenMerging) {
  mapper_->Process(Beginning(0, MakeRingMap(ExactRing()).map));
  mapper_->Process(Beginning(1, BeginningOfTheRingAgain()));
  ASSERT_EQ(mapper_->Counters().merges, 1);
  const Map map = std::move(*mapper_).MapOf(0);
  EXPECT_EQ(map.At(0).parent, kNoKeyframe);
  for (const auto& [id, keyframe] : map.Keyframes()) {
    EXPECT_TRUE(id == 0 || map.HasKeyframe(keyframe.parent)) << id;
  }
  EXPECT_NEAR(static_cast<double>(map.At(107).parent), 7.0, 1.0) << "it stands where keyframe 7 stood";
}

// The first map is a little off where the second meets it, out of sight of its own newest keyframe.
TEST_F(MapperWithWords, AdjustsBothSidesOfMerge) {
  options_.mapping.bundle_adjustment.max_keyframes = 3;
  options_.mapping.loops.bundle_iterations = 0;  // not the whole map
  Restart(RandomWords());
  RingMapOptions first = ExactRing();
  first.keyframes = 20;
  SyntheticMap ring = MakeRingMap(first);
  const Eigen::Vector3d off(0.008, -0.004, 0.004);
  for (KeyframeId id = 5; id <= 9; ++id) {
    ring.map.At(id).T_camera_map.translation += id % 2 == 0 ? off : Eigen::Vector3d(-off);
  }
  mapper_->Process(Beginning(0, std::move(ring.map)));
  mapper_->Process(Beginning(1, BeginningOfTheRingAgain()));
  ASSERT_EQ(mapper_->Counters().merges, 1);
  const Map map = std::move(*mapper_).MapOf(0);
  int adjusted = 0;
  for (KeyframeId id = 5; id <= 9; ++id) {
    const Rigid3d truth = testing::PoseOnRing(15.0 * static_cast<double>(id));
    adjusted += CenterDistance(map.At(id).T_camera_map, truth) < 0.75 * off.norm() ? 1 : 0;
  }
  EXPECT_EQ(adjusted, 3) << "the keyframe that the second map meets, and two neighbours";
}

}  // namespace
}  // namespace sqslam
