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

// The scale prediction must not be off by a level: a point is looked for where it was seen.
TEST(FindKeypoint, FindsEachPointAtItsKeypoint) {
  const SyntheticMap world = MakeSyntheticMap({.keyframes = 4, .points = 200});
  for (const auto& [id, keyframe] : world.map.Keyframes()) {
    for (const MapPoint& point : world.map.Points()) {
      EXPECT_EQ(FindKeypoint(world.map.Levels(), world.camera, keyframe.T_camera_map, *keyframe.features,
                             point, {}),
                static_cast<int>(point.id));
    }
  }
}

TEST(FindKeypoint, RejectsPointsThatFaceAwayOrLieBehind) {
  const SyntheticMap world = MakeSyntheticMap({.keyframes = 2, .points = 50});
  const Keyframe& keyframe = world.map.At(0);
  const auto find = [&](const Rigid3d& T_camera_map, const MapPoint& point) {
    return FindKeypoint(world.map.Levels(), world.camera, T_camera_map, *keyframe.features, point, {});
  };
  MapPoint flipped = world.map.Point(3);
  flipped.normal = -flipped.normal;
  EXPECT_EQ(find(keyframe.T_camera_map, flipped), -1);
  MapPoint other = world.map.Point(3);
  for (std::uint8_t& byte : other.descriptor) {
    byte = static_cast<std::uint8_t>(~byte);
  }
  EXPECT_EQ(find(keyframe.T_camera_map, other), -1);
  const Rigid3d turned{Eigen::Quaterniond(Eigen::AngleAxisd(3.1, Eigen::Vector3d::UnitY())), {0.0, 0.0, 0.0}};
  EXPECT_EQ(find(turned * keyframe.T_camera_map, world.map.Point(3)), -1);
}

TEST(FuseInto, MergesTwoCopiesOfOnePoint) {
  SyntheticMap world = MakeSyntheticMap({.keyframes = 4, .points = 100});
  Map& map = world.map;
  // Keyframe 3 sees point 7 as a point of its own.
  map.RemoveObservation(7, 3);
  const PointId copy = map.AddPoint(map.Point(7).p_map, 3);
  map.AddObservation(copy, 3, 7);
  EXPECT_EQ(FuseInto(map, world.camera, {7}, 3, {}), 1);
  EXPECT_EQ(map.Resolve(copy), 7);
  EXPECT_EQ(map.At(3).points[7], 7);
  EXPECT_EQ(CountBrokenReferences(map), 0);
}

constexpr KeyframeId kLast = 4;
constexpr PointId kFirstCopy = 100;  // points from here to
constexpr PointId kEndCopies = 200;  // here have a copy

// Keyframes 3 and 4 see the points 100 to 199 as copies: map points of their own.
class FusionTest : public ::testing::Test {
 protected:
  void MakeCopies(const Eigen::Vector3d& offset = Eigen::Vector3d::Zero()) {
    Map& map = world_.map;
    for (PointId id = kFirstCopy; id < kEndCopies; ++id) {
      const PointId copy = map.AddPoint(map.Point(id).p_map + offset, 3);
      for (const KeyframeId keyframe : {KeyframeId{3}, kLast}) {
        map.RemoveObservation(id, keyframe);
        map.AddObservation(copy, keyframe, static_cast<int>(id));
      }
      map.UpdateAppearance(copy);
      copies_.push_back(copy);
    }
    for (KeyframeId id = 0; id <= kLast; ++id) {
      map.UpdateCovisibility(id);
    }
  }
  int Fuse(const FusionOptions& options = {}) {
    return FuseWithNeighbours(world_.map, world_.camera, kLast, options);
  }

  SyntheticMap world_ = MakeSyntheticMap({.keyframes = 5});
  std::vector<PointId> copies_;
};

TEST_F(FusionTest, FusesNewPointsWithKnownOnesAtOnce) {
  Map& map = world_.map;
  for (PointId id = kFirstCopy; id < kEndCopies; ++id) {
    map.RemoveObservation(id, 3);
    map.RemoveObservation(id, kLast);
  }
  for (KeyframeId id = 0; id <= kLast; ++id) {
    map.UpdateCovisibility(id);
  }
  const int points = map.NumPoints();
  const std::vector<PointId> created = AddNewPoints(map, world_.camera, kLast);
  EXPECT_GE(created.size(), 90U);
  EXPECT_EQ(map.NumPoints(), points) << "all of them were known";
  for (const PointId id : created) {
    EXPECT_NE(map.Resolve(id), id);
    EXPECT_NE(map.Resolve(id), kNoPoint);
  }
  EXPECT_EQ(CountBrokenReferences(map), 0);
}

TEST_F(FusionTest, KeepsAllObservations) {
  MakeCopies();
  const int points = world_.map.NumPoints();
  EXPECT_GE(Fuse(), 100);
  EXPECT_EQ(world_.map.NumPoints(), points - 100);
  for (PointId id = kFirstCopy; id < kEndCopies; ++id) {
    const PointId copy = copies_[static_cast<std::size_t>(id - kFirstCopy)];
    EXPECT_EQ(world_.map.Resolve(copy), id) << "the one with fewer observations goes";
    // The keyframes that saw the one or the other, none twice.
    std::vector<KeyframeId> keyframes;
    for (const Observation& o : world_.map.Point(id).observations) {
      keyframes.push_back(o.keyframe);
      EXPECT_EQ(o.keypoint, id);
    }
    std::sort(keyframes.begin(), keyframes.end());
    EXPECT_EQ(keyframes, (std::vector<KeyframeId>{0, 1, 2, 3, 4}));
    EXPECT_EQ(world_.map.Point(id).visible, 2);
    EXPECT_EQ(world_.map.Point(id).found, 2);
  }
  EXPECT_EQ(CountBrokenReferences(world_.map), 0);
  EXPECT_EQ(world_.map.At(kLast).covisibility.at(0), 300);
  EXPECT_EQ(Fuse(), 0) << "nothing is left to do";
}

// Keyframe 2 shows point and copy at two keypoints half a pixel apart.
TEST_F(FusionTest, LeavesOneKeypointPerKeyframeAndPoint) {
  MakeCopies();
  Keyframe& keyframe = world_.map.At(2);
  auto features = std::make_shared<FrameFeatures>(*keyframe.features);
  for (std::size_t i = kFirstCopy; i < kEndCopies; ++i) {
    Keypoint beside = features->keypoints[i];
    beside.pixel.x() += 0.5;
    features->keypoints.push_back(beside);
    features->descriptors.push_back(features->descriptors[i]);
  }
  features->colors.resize(features->Size());
  features->grid = KeypointGrid(features->keypoints, world_.camera.width, world_.camera.height);
  keyframe.features = features;
  keyframe.points.resize(features->Size(), kNoPoint);
  for (std::size_t i = 0; i < copies_.size(); ++i) {
    world_.map.AddObservation(copies_[i], 2, static_cast<int>(300 + i));
  }
  EXPECT_GE(Fuse(), 100);
  EXPECT_EQ(world_.map.NumPoints(), 300);
  EXPECT_EQ(CountBrokenReferences(world_.map), 0);
  for (const PointId copy : copies_) {
    EXPECT_EQ(world_.map.Point(world_.map.Resolve(copy)).observations.size(), 5U);
  }
}

TEST_F(FusionTest, AddsMissingObservations) {
  for (PointId id = 0; id < 50; ++id) {
    world_.map.RemoveObservation(id, kLast);
    world_.map.RemoveObservation(id + 50, 1);
  }
  EXPECT_EQ(Fuse(), 100);
  for (PointId id = 0; id < 300; ++id) {
    EXPECT_EQ(world_.map.Point(id).observations.size(), 5U);
  }
  EXPECT_EQ(CountBrokenReferences(world_.map), 0);
}

// Other points that look the same, 6 px away.
TEST_F(FusionTest, DoesNotFusePointsElsewhere) {
  const Eigen::Vector3d offset(0.0, 0.05, 0.0);
  for (const KeyframeId id : {KeyframeId{3}, kLast}) {
    Keyframe& keyframe = world_.map.At(id);
    auto features = std::make_shared<FrameFeatures>(*keyframe.features);
    for (std::size_t i = kFirstCopy; i < kEndCopies; ++i) {
      features->keypoints[i].pixel =
          world_.camera.Project(keyframe.T_camera_map * (world_.points[i] + offset));
    }
    features->grid = KeypointGrid(features->keypoints, world_.camera.width, world_.camera.height);
    keyframe.features = features;
  }
  MakeCopies(offset);
  EXPECT_EQ(Fuse({.radius = 10.0}), 0);
  EXPECT_EQ(world_.map.NumPoints(), 400);
}

TEST_F(FusionTest, DoesNotFusePointsThatLookDifferent) {
  for (const KeyframeId id : {KeyframeId{3}, kLast}) {
    auto features = std::make_shared<FrameFeatures>(*world_.map.At(id).features);
    std::reverse(features->descriptors.begin() + kFirstCopy, features->descriptors.begin() + kEndCopies);
    world_.map.At(id).features = features;
  }
  MakeCopies();
  EXPECT_EQ(Fuse(), 0);
  EXPECT_EQ(world_.map.NumPoints(), 400);
}

TEST_F(FusionTest, CommutesWithASimilarity) {
  MakeCopies();
  SyntheticMap moved = world_;
  moved.map.Transform(
      Sim3d{0.3,
            Eigen::Quaterniond(Eigen::AngleAxisd(0.8, Eigen::Vector3d(1.0, 2.0, 3.0).normalized())),
            {3.0, -1.0, 7.0}});
  EXPECT_EQ(FuseWithNeighbours(moved.map, moved.camera, kLast, {}), Fuse());
  for (KeyframeId id = 0; id <= kLast; ++id) {
    EXPECT_EQ(moved.map.At(id).points, world_.map.At(id).points);
  }
}

// On the ring keyframe 14 sees much of what keyframe 12 sees, but has lost it: only the neighbours of
// neighbours tell.
TEST(FusionReach, IncludesNeighboursOfNeighbours) {
  SyntheticMap ring = MakeRingMap(ExactRing());
  Map& map = ring.map;
  std::vector<PointId> shared;
  for (const PointId point : map.At(12).points) {
    const auto& observations = map.Point(point).observations;
    if (std::any_of(observations.begin(), observations.end(),
                    [](const Observation& o) { return o.keyframe == 14; })) {
      shared.push_back(point);
    }
  }
  ASSERT_GT(shared.size(), 50U);
  for (const PointId point : shared) {
    map.RemoveObservation(point, 14);
  }
  for (const KeyframeId id : {12, 14}) {
    map.UpdateCovisibility(id);
  }
  ASSERT_FALSE(map.At(12).covisibility.contains(14));
  Map without = map;
  FuseWithNeighbours(without, ring.camera, 12, {.second_neighbours = 0});
  EXPECT_FALSE(without.At(12).covisibility.contains(14));
  FuseWithNeighbours(map, ring.camera, 12, {});
  EXPECT_GT(map.At(12).covisibility.at(14), static_cast<int>(shared.size()) * 9 / 10);
}

}  // namespace
}  // namespace sqslam
