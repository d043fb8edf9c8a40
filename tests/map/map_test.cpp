#include "slam/map/map.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/support/synthetic_map.h"

namespace sqslam {
namespace {

using testing::CountBrokenReferences;
using testing::MakeSyntheticMap;
using testing::SyntheticMap;

TEST(Map, KeepsReferencesMutualUnderRandomEdits) {
  SyntheticMap world = MakeSyntheticMap({});
  Map& map = world.map;
  std::mt19937 random(5);
  for (int step = 0; step < 200; ++step) {
    const auto a = static_cast<PointId>(random() % 300);
    const auto b = static_cast<PointId>(random() % 300);
    switch (random() % 3) {
      case 0:
        map.Fuse(a, b);
        break;
      case 1:
        map.RemovePoint(a);
        break;
      default:
        map.RemoveObservation(a, static_cast<KeyframeId>(random() % 6));
    }
  }
  map.RemoveKeyframe(3);
  for (const auto& [id, keyframe] : map.Keyframes()) {
    map.UpdateCovisibility(id);
  }
  EXPECT_EQ(CountBrokenReferences(map), 0);
  int alive = 0;
  for (const MapPoint& point : map.Points()) {
    ++alive;
    EXPECT_GE(point.observations.size(), 2U);
  }
  EXPECT_EQ(map.NumPoints(), alive);
}

TEST(Map, ResolvesChainsOfFusions) {
  SyntheticMap world = MakeSyntheticMap({});
  world.map.Fuse(1, 2);
  world.map.Fuse(2, 3);
  EXPECT_EQ(world.map.Resolve(1), 3);
  EXPECT_EQ(world.map.Point(3).observations.size(), 6U);
  world.map.RemovePoint(3);
  EXPECT_EQ(world.map.Resolve(1), kNoPoint);
}

TEST(Map, MovesRemovedKeyframeWithParent) {
  SyntheticMap world = MakeSyntheticMap({});
  Map& map = world.map;
  const Rigid3d before = map.PoseOf(4).T_camera_map;
  map.RemoveKeyframe(4);
  EXPECT_FALSE(map.HasKeyframe(4));
  EXPECT_TRUE(map.PoseOf(4).T_camera_map.Matrix().isApprox(before.Matrix(), 1e-12));
  map.RemoveKeyframe(map.Removed().at(4).pose.reference);
  EXPECT_TRUE(map.PoseOf(4).T_camera_map.Matrix().isApprox(before.Matrix(), 1e-12));
}

// Keyframes without a parent; the number of keyframes where the way up from one of them leads in a circle.
int CountRoots(const Map& map) {
  int roots = 0;
  for (const auto& [id, keyframe] : map.Keyframes()) {
    roots += keyframe.parent == kNoKeyframe ? 1 : 0;
    KeyframeId up = id;
    for (std::size_t i = 0; i < map.Keyframes().size() && up != kNoKeyframe; ++i) {
      up = map.At(up).parent;
    }
    if (up != kNoKeyframe) {
      return static_cast<int>(map.Keyframes().size());
    }
  }
  return roots;
}

void MakeChain(Map& map) {
  for (const auto& [id, keyframe] : map.Keyframes()) {
    map.At(id).parent = id - 1;  // kNoKeyframe of the first
  }
}

TEST(SpanningTree, ReversesEdgesWhenRerooted) {
  static_assert(kNoKeyframe == -1);
  SyntheticMap world = MakeSyntheticMap({});
  Map& map = world.map;
  MakeChain(map);
  map.Reroot(3);
  const std::vector<KeyframeId> parents{1, 2, 3, kNoKeyframe, 3, 4};
  for (const auto& [id, keyframe] : map.Keyframes()) {
    EXPECT_EQ(keyframe.parent, parents[static_cast<std::size_t>(id)]) << id;
  }
  map.At(5).parent = kNoKeyframe;  // a tree of its own
  map.Reroot(1, 5);
  EXPECT_EQ(map.At(1).parent, 5);
  EXPECT_EQ(CountRoots(map), 1);
}

TEST(SpanningTree, StaysOneTreeWhenRootIsRemoved) {
  SyntheticMap world = MakeSyntheticMap({});
  Map& map = world.map;
  MakeChain(map);
  for (PointId point = 0; point < 100; ++point) {  // keyframe 0 sees most with a grandchild of its own
    map.RemoveObservation(point, 1);
  }
  map.UpdateCovisibility(1);
  map.At(0).covisibility.at(3) += 1;
  map.RemoveKeyframe(0);
  EXPECT_EQ(CountRoots(map), 1);
  EXPECT_EQ(map.At(3).parent, kNoKeyframe);
}

TEST(SpanningTree, GivesRootNoParentFromBelow) {
  SyntheticMap world = MakeSyntheticMap({});
  Map& map = world.map;
  MakeChain(map);
  map.Reroot(3);
  map.UpdateCovisibility(3);  // all older keyframes hang below it
  EXPECT_EQ(CountRoots(map), 1);
}

TEST(Map, TransformKeepsEveryProjection) {
  SyntheticMap world = MakeSyntheticMap({});
  const Rigid3d T_new_old{
      Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1.0, 2.0, 3.0).normalized())),
      {0.1, -2.0, 0.5}};
  const Rigid3d culled = world.map.PoseOf(2).T_camera_map;
  world.map.RemoveKeyframe(2);
  world.map.Transform(Sim3d::FromRigid(T_new_old));
  for (const auto& [id, keyframe] : world.map.Keyframes()) {
    for (const MapPoint& point : world.map.Points()) {
      const Eigen::Vector3d expected =
          world.T_camera_map[static_cast<std::size_t>(id)] * world.points[static_cast<std::size_t>(point.id)];
      EXPECT_TRUE((keyframe.T_camera_map * point.p_map).isApprox(expected, 1e-9));
    }
  }
  EXPECT_TRUE((world.map.PoseOf(2).T_camera_map * (T_new_old * world.points[0]))
                  .isApprox(culled * world.points[0], 1e-9));
}

TEST(Map, AnchoredFramesFollowChangeOfScale) {
  SyntheticMap world = MakeSyntheticMap({});
  Map& map = world.map;
  const Rigid3d T_frame_2{Eigen::Quaterniond(Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitY())),
                          {0.1, 0.02, -0.05}};
  const AnchoredPose anchor{2, T_frame_2, map.At(2).scale};
  const Eigen::Vector3d p_frame = Resolve(anchor, map.PoseOf(2)).T_camera_map * world.points[7];
  const Sim3d S_new_old{
      3.0, Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitZ())), {1.0, 2.0, 3.0}};
  map.RemoveKeyframe(2);  // its pose lives on with its parent
  map.Transform(S_new_old);
  map.RemoveKeyframe(map.Removed().at(2).pose.reference);
  map.Transform(S_new_old);
  const ScaledPose pose = Resolve(anchor, map.PoseOf(2));
  EXPECT_NEAR(pose.scale, 9.0, 1e-12);
  // The same ray, nine times as long.
  EXPECT_TRUE(
      (pose.T_camera_map * (S_new_old * (S_new_old * world.points[7]))).isApprox(9.0 * p_frame, 1e-9));
}

TEST(Map, AbsorbsMapOfSameRun) {
  const auto ids = std::make_shared<IdSource>();
  const ScaleLevels levels{OrbOptions{}};
  auto features = std::make_shared<FrameFeatures>();
  features->keypoints.resize(2);
  features->descriptors.resize(2);
  features->colors.resize(2);
  const auto fill = [&](Map& map, double x) {
    const KeyframeId a = map.AddKeyframe(0, 0.0, {}, features);
    const KeyframeId b = map.AddKeyframe(1, 0.1, {}, features);
    const PointId point = map.AddPoint({x, 0.0, 1.0}, a);
    map.AddObservation(point, a, 0);
    map.AddObservation(point, b, 1);
    return point;
  };
  Map first(levels, ids);
  Map second(levels, ids);
  const PointId p = fill(first, 1.0);
  const PointId q = fill(second, 2.0);
  ASSERT_NE(p, q);
  first.Absorb(std::move(second));
  EXPECT_EQ(first.Keyframes().size(), 4U);
  EXPECT_EQ(first.NumPoints(), 2);
  EXPECT_EQ(first.Point(q).p_map.x(), 2.0);
  EXPECT_EQ(CountBrokenReferences(first), 0);
}

TEST(Map, CovisibilityCountsSharedPoints) {
  SyntheticMap world = MakeSyntheticMap({});
  EXPECT_EQ(world.map.At(0).covisibility.at(5), 300);
  world.map.RemovePoint(0);
  world.map.UpdateCovisibility(0);
  EXPECT_EQ(world.map.At(0).covisibility.at(5), 299);
  EXPECT_EQ(world.map.At(5).covisibility.at(0), 299);
}

TEST(TrackingView, DoesNotChangeWithMap) {
  SyntheticMap world = MakeSyntheticMap({});
  world.map.RemoveKeyframe(3);
  const TrackingView view = MakeTrackingView(world.map);
  world.map.Fuse(0, 1);
  world.map.Point(1).p_map.setZero();
  EXPECT_TRUE(view.Has(0));
  EXPECT_TRUE(view.Point(1).p_map.isApprox(world.points[1]));
  EXPECT_EQ(view.keyframes.size(), 5U);
  EXPECT_TRUE(view.PoseOf(3).T_camera_map.Matrix().isApprox(world.T_camera_map[3].Matrix(), 1e-9));
  world.map.RemoveKeyframe(2);
  EXPECT_EQ(view.removed.size(), 1U);
  EXPECT_TRUE(view.keyframes.contains(2));
}

}  // namespace
}  // namespace sqslam
