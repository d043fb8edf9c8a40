#include <gtest/gtest.h>

#include <algorithm>

#include "slam/mapping/local_mapping.h"
#include "tests/support/synthetic_map.h"

namespace sqslam {
namespace {

using testing::CountBrokenReferences;
using testing::ExactRing;
using testing::MakeRingMap;
using testing::MakeSyntheticMap;
using testing::SyntheticMap;
using testing::WithOctave;

class PointCulling : public ::testing::Test {
 protected:
  // Leaves the point with so many keyframes.
  void SeenBy(PointId point, KeyframeId count) {
    for (KeyframeId id = 5; id >= count; --id) {
      world_.map.RemoveObservation(point, id);
    }
  }
  int Cull(KeyframeId newest) { return CullPoints(world_.map, young_, newest); }

  SyntheticMap world_ = MakeSyntheticMap({.points = 50});  // all first seen by keyframe 0
  std::set<PointId> young_{0, 1, 2};
};

TEST_F(PointCulling, RemovesPointsThatTrackingRarelyFinds) {
  world_.map.Point(0).visible = 9;
  world_.map.Point(0).found = 2;
  world_.map.Point(1).visible = 8;
  world_.map.Point(1).found = 2;
  EXPECT_EQ(Cull(1), 1);
  EXPECT_FALSE(world_.map.IsAlive(0));
  EXPECT_EQ(young_, (std::set<PointId>{1, 2}));
}

TEST_F(PointCulling, RemovesPointsWithTooFewObserversAfterTwoKeyframes) {
  SeenBy(0, 2);
  SeenBy(1, 3);
  EXPECT_EQ(Cull(1), 0);
  EXPECT_EQ(Cull(2), 1);
  EXPECT_FALSE(world_.map.IsAlive(0));
  EXPECT_TRUE(world_.map.IsAlive(1));
  EXPECT_EQ(CountBrokenReferences(world_.map), 0);
}

TEST_F(PointCulling, KeepsPointsForGoodAfterThreeKeyframes) {
  EXPECT_EQ(Cull(2), 0);
  EXPECT_EQ(young_.size(), 3U);
  EXPECT_EQ(Cull(3), 0);
  EXPECT_TRUE(young_.empty());
  SeenBy(0, 2);
  EXPECT_EQ(Cull(4), 0) << "it is no longer young";
  EXPECT_TRUE(world_.map.IsAlive(0));
}

TEST_F(PointCulling, ForgetsRemovedPoints) {
  world_.map.RemovePoint(0);
  world_.map.Fuse(1, 2);
  EXPECT_EQ(Cull(1), 0);
  EXPECT_EQ(young_, std::set<PointId>{2});
}

class KeyframeCulling : public ::testing::Test {
 protected:
  std::vector<KeyframeId> Cull(KeyframeId center = 5, const LoopEdges& loop_edges = {}) {
    std::vector<KeyframeId> culled = CullKeyframes(world_.map, center, {}, loop_edges);
    std::sort(culled.begin(), culled.end());
    return culled;
  }
  // Gives keyframe 3 so many points that no other sees.
  void GiveOwnPoints(int count) {
    for (int i = 0; i < count; ++i) {
      const PointId own = world_.map.AddPoint(world_.points[static_cast<std::size_t>(i)], 3);
      world_.map.RemoveObservation(i, 3);
      world_.map.AddObservation(own, 3, i);
    }
  }

  SyntheticMap world_ = MakeSyntheticMap({});
};

TEST_F(KeyframeCulling, RemovesKeyframesWhosePointsOthersSee) {
  EXPECT_EQ(Cull(), (std::vector<KeyframeId>{2, 3, 4}));
  EXPECT_EQ(world_.map.Keyframes().size(), 3U);
  EXPECT_EQ(world_.map.NumPoints(), 300) << "no point is lost";
  EXPECT_EQ(CountBrokenReferences(world_.map), 0);
}

TEST_F(KeyframeCulling, KeepsFirstTwoKeyframesAndCentre) {
  EXPECT_EQ(Cull(4), (std::vector<KeyframeId>{2, 3, 5}));
  for (const KeyframeId id : {0, 1, 4}) {
    EXPECT_TRUE(world_.map.HasKeyframe(id));
  }
}

TEST_F(KeyframeCulling, KeepsKeyframeThatAloneSeesPoints) {
  GiveOwnPoints(30);  // a tenth of its points
  EXPECT_EQ(Cull(), (std::vector<KeyframeId>{2, 4}));
  for (const PointId point : world_.map.At(3).points) {
    EXPECT_TRUE(world_.map.IsAlive(point));
  }
}

TEST_F(KeyframeCulling, RemovesKeyframeThatAloneSeesFewPoints) {
  GiveOwnPoints(29);
  EXPECT_EQ(Cull(), (std::vector<KeyframeId>{2, 3, 4}));
}

TEST_F(KeyframeCulling, NeedsThreeOtherObserversOfEachPoint) {
  for (PointId point = 0; point < 40; ++point) {
    for (const KeyframeId id : {0, 1}) {
      world_.map.RemoveObservation(point, id);
    }
  }
  // Each of 2, 3 and 4 is seen to be redundant until the first of them is gone.
  EXPECT_EQ(Cull().size(), 1U);
}

TEST_F(KeyframeCulling, KeepsKeyframeWithFinerScale) {
  for (const auto& [id, keyframe] : world_.map.Keyframes()) {
    if (id != 3) {
      world_.map.At(id).features = WithOctave(*keyframe.features, 2);
    }
  }
  EXPECT_EQ(Cull(), (std::vector<KeyframeId>{2, 4}));
  for (const KeyframeId id : {0, 1, 5}) {
    world_.map.At(id).features = WithOctave(*world_.map.At(id).features, 1);  // about as fine
  }
  EXPECT_EQ(Cull(), std::vector<KeyframeId>{3});
}

TEST_F(KeyframeCulling, KeepsEndsOfLoopEdges) {
  EXPECT_EQ(Cull(5, {{1, 3}}), (std::vector<KeyframeId>{2, 4}));
  EXPECT_EQ(Cull(5, {}), std::vector<KeyframeId>{3}) << "which nothing else held";
}

TEST_F(KeyframeCulling, RecordsPosesOfRemovedKeyframes) {
  for (const KeyframeId id : Cull()) {
    EXPECT_LT(testing::CenterDistance(world_.map.PoseOf(id).T_camera_map,
                                      world_.T_camera_map[static_cast<std::size_t>(id)]),
              1e-9);
  }
  for (const auto& [id, keyframe] : world_.map.Keyframes()) {
    EXPECT_TRUE(id == 0 || world_.map.HasKeyframe(keyframe.parent)) << "the spanning tree stays whole";
  }
}

TEST_F(KeyframeCulling, CommutesWithASimilarity) {
  SyntheticMap moved = world_;
  moved.map.Transform(Sim3d{0.3, Eigen::Quaterniond::Identity(), {3.0, -1.0, 7.0}});
  EXPECT_EQ(CullKeyframes(moved.map, 5, {}, {}), CullKeyframes(world_.map, 5, {}, {}));
}

// Keyframes on the far side of the ring share no point with the centre.
TEST(RingCulling, KeepsFarKeyframes) {
  SyntheticMap ring = MakeRingMap(ExactRing());
  for (const KeyframeId culled : CullKeyframes(ring.map, 10, {}, {})) {
    EXPECT_LE(std::abs(culled - 10), 5);
  }
  EXPECT_EQ(CountBrokenReferences(ring.map), 0);
}

}  // namespace
}  // namespace sqslam
