#include <gtest/gtest.h>

#include "slam/mapping/fusion.h"
#include "tests/support/synthetic_map.h"

namespace sqslam {
namespace {

using testing::CountBrokenReferences;
using testing::MakeSyntheticMap;
using testing::SyntheticMap;

// The scale prediction must not be off by a level: a point is looked for where it was seen.
TEST(FindKeypoint, FindsEachPointWhereItWasSeen) {
  const SyntheticMap world = MakeSyntheticMap({.keyframes = 4, .points = 200});
  for (const auto& [id, keyframe] : world.map.Keyframes()) {
    for (const MapPoint& point : world.map.Points()) {
      EXPECT_EQ(FindKeypoint(world.map.Levels(), world.camera, keyframe.T_camera_map, *keyframe.features,
                             point, {}),
                static_cast<int>(point.id));
    }
  }
}

TEST(FindKeypoint, RefusesWhatLooksElsewhereOrLiesBehind) {
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

TEST(FuseInto, MakesTwoCopiesOfAPointOne) {
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

}  // namespace
}  // namespace sqslam
