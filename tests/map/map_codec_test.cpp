#include "slam/map/map_codec.h"

#include <gtest/gtest.h>

#include <memory>
#include <random>

#include "tests/support/synthetic_map.h"

namespace sqslam {
namespace {

using testing::CountBrokenReferences;
using testing::MakeSyntheticMap;
using testing::SyntheticMap;

// A map with all that a long run leaves: fused and removed points, a removed keyframe, clutter.
SyntheticMap LivedIn() {
  SyntheticMap world = MakeSyntheticMap({.pixel_noise = 0.3});
  Map& map = world.map;
  for (PointId id = 0; id < 30; id += 3) {
    map.Fuse(id, id + 1);
    map.RemovePoint(id + 2);
  }
  for (const auto& [id, keyframe] : map.Keyframes()) {
    map.UpdateCovisibility(id);
  }
  map.RemoveKeyframe(3);
  map.AddPoint({}, 0);
  map.RemovePoint(map.Points().IdBound() - 1);
  map.Point(1).visible = 9;
  map.Point(1).found = 4;
  return world;
}

std::string Written(const Map& map) {
  ByteWriter writer;
  WriteMap(map, writer);
  return writer.Take();
}

Map Read(const std::string& bytes, const Camera& camera) {
  Map map{ScaleLevels(OrbOptions{})};
  ByteReader reader(bytes, "the map");
  ReadMap(reader, camera, map);
  EXPECT_TRUE(reader.AtEnd());
  return map;
}

TEST(MapCodec, RestoresMap) {
  const SyntheticMap world = LivedIn();
  const std::string bytes = Written(world.map);
  const Map read = Read(bytes, world.camera);
  EXPECT_TRUE(Written(read) == bytes);
  EXPECT_EQ(CountBrokenReferences(read), 0);
  ASSERT_EQ(read.NumPoints(), world.map.NumPoints());
  for (const MapPoint& point : world.map.Points()) {
    const MapPoint& same = read.Point(point.id);
    EXPECT_EQ(same.p_map, point.p_map);
    EXPECT_EQ(same.descriptor, point.descriptor);
    EXPECT_EQ(same.visible, point.visible);
    EXPECT_EQ(same.found, point.found);
    ASSERT_EQ(same.observations.size(), point.observations.size());
  }
  ASSERT_EQ(read.Keyframes().size(), world.map.Keyframes().size());
  for (const auto& [id, keyframe] : world.map.Keyframes()) {
    const Keyframe& same = read.At(id);
    EXPECT_EQ(same.points, keyframe.points);
    EXPECT_EQ(same.covisibility, keyframe.covisibility);
    EXPECT_EQ(same.parent, keyframe.parent);
    EXPECT_EQ(same.features->descriptors, keyframe.features->descriptors);
    for (std::size_t i = 0; i < keyframe.features->Size(); ++i) {
      EXPECT_LE((same.features->keypoints[i].pixel - keyframe.features->keypoints[i].pixel).norm(), 0.012);
    }
  }
  EXPECT_EQ(read.Resolve(0), world.map.Resolve(0));
  EXPECT_EQ(read.Resolve(2), kNoPoint);
  EXPECT_TRUE(read.PoseOf(3).T_camera_map.Matrix().isApprox(world.map.PoseOf(3).T_camera_map.Matrix()));
}

Map WithSigma(Map map, float sigma) {
  auto features = std::make_shared<FrameFeatures>(*map.At(0).features);
  features->keypoints[0].sigma = sigma;
  map.At(0).features = features;
  return map;
}

TEST(MapCodec, KeepsWhichKeypointsAreAligned) {
  const SyntheticMap world = LivedIn();
  const Map read = Read(Written(WithSigma(world.map, 0.3F)), world.camera);
  EXPECT_NEAR(read.At(0).features->keypoints[0].sigma, 0.3, 0.005);
  EXPECT_EQ(read.At(0).features->keypoints[1].sigma, 1.0F);
}

TEST(MapCodec, RefusesImpossibleStandardDeviations) {
  const SyntheticMap world = LivedIn();
  EXPECT_THROW(Read(Written(WithSigma(world.map, 0.0F)), world.camera), InputError);
  EXPECT_THROW(Read(Written(WithSigma(world.map, 1.5F)), world.camera), InputError);
}

TEST(MapCodec, RefusesTruncatedBytes) {
  const SyntheticMap world = LivedIn();
  const std::string bytes = Written(world.map);
  for (std::size_t size = 0; size < bytes.size(); size += 1 + bytes.size() / 97) {
    EXPECT_THROW(Read(bytes.substr(0, size), world.camera), InputError) << size;
  }
}

// Damage that it does not notice (a coordinate, a bit of a descriptor) must at least give a map.
TEST(MapCodec, ReadsDamagedBytesAsErrorOrValidMap) {
  const SyntheticMap world = LivedIn();
  const std::string bytes = Written(world.map);
  std::mt19937 random(3);
  int refused = 0;
  for (int i = 0; i < 300; ++i) {
    std::string damaged = bytes;
    // Ids, counts and poses come first, keypoints and descriptors later.
    const std::size_t place = random() % (i % 2 == 0 ? bytes.size() : bytes.size() / 8);
    damaged[place] = static_cast<char>(random());
    try {
      EXPECT_EQ(CountBrokenReferences(Read(damaged, world.camera)), 0);
    } catch (const InputError&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 20);
}

}  // namespace
}  // namespace sqslam
