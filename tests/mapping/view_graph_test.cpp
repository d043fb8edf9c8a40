#include "slam/mapping/view_graph.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <vector>

#include "tests/support/synthetic_map.h"

namespace sqslam {
namespace {

using testing::MakeSyntheticMap;
using testing::PoseOnArc;
using testing::SyntheticMap;

// The same images as another camera sees them: other pixels without distortion, the same descriptors.
FrameFeaturesPtr Moved(const FrameFeaturesPtr& features) {
  FrameFeatures moved = *features;
  for (Keypoint& keypoint : moved.keypoints) {
    keypoint.pixel *= 1.01;
  }
  return std::make_shared<const FrameFeatures>(std::move(moved));
}

TEST(ViewGraph, SearchesPairsOnceForAllCameras) {
  const SyntheticMap world = MakeSyntheticMap({});
  const PlaceRecognizer places(world.camera, {}, nullptr);
  const auto database = std::make_shared<FeatureDatabase>();
  std::vector<FrameFeaturesPtr> images;
  for (const std::uint64_t seed : {1, 2, 3}) {
    images.push_back(
        world.See(PoseOnArc(seed), {.pixel_noise = 0.2, .flipped_bits = 10, .seed = seed}).features);
  }
  ViewGraph first(world.camera, places, database);
  ViewGraph alone(world.camera, places);
  Camera longer = world.camera;
  longer.fx *= 1.01;
  longer.fy *= 1.01;
  ViewGraph second(longer, places, database);
  for (std::size_t i = 0; i < images.size(); ++i) {
    first.Add(static_cast<std::int64_t>(i), images[i]);
    alone.Add(static_cast<std::int64_t>(i), images[i]);
    second.Add(static_cast<std::int64_t>(i), Moved(images[i]));
  }
  first.Match();
  alone.Match();
  EXPECT_EQ(database->Searched(), 3);
  second.Match();
  EXPECT_EQ(database->Searched(), 3) << "the same descriptors";
  for (std::int64_t i = 0; i < 3; ++i) {
    EXPECT_EQ(first.MatchesOf(i), alone.MatchesOf(i));
    EXPECT_EQ(first.MatchesOf(i).size(), 2);
    EXPECT_EQ(second.MatchesOf(i).size(), 2);
  }
}

}  // namespace
}  // namespace sqslam
