#include "slam/mapping/feature_database.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>
#include <utility>

#include "tests/support/synthetic_map.h"

namespace sqslam {
namespace {

using testing::MakeSyntheticMap;
using testing::PoseOnArc;
using testing::SyntheticMap;

TEST(FeatureDatabase, ExtractsImageOnce) {
  FeatureDatabase database;
  int extracted = 0;
  const auto extract = [&] {
    ++extracted;
    FrameFeatures features;
    features.keypoints.resize(3);
    return features;
  };
  const FrameFeaturesPtr first = database.FeaturesOf("a.png", extract);
  EXPECT_EQ(first->keypoints.size(), 3);
  EXPECT_EQ(database.FeaturesOf("a.png", extract), first);
  EXPECT_EQ(extracted, 1);
  EXPECT_NE(database.FeaturesOf("b.png", extract), first);
  EXPECT_EQ(extracted, 2);
}

TEST(FeatureDatabase, KeepsFeaturesOfFirstImages) {
  FeatureDatabase database;
  int extracted = 0;
  const auto extract = [&] {
    ++extracted;
    return FrameFeatures();
  };
  for (int pass = 0; pass < 2; ++pass) {
    for (int i = 0; i <= FeatureDatabase::kMaxImages; ++i) {
      database.FeaturesOf(std::to_string(i), extract);
    }
  }
  EXPECT_EQ(extracted, FeatureDatabase::kMaxImages + 2);
}

TEST(FeatureDatabase, TellsImagesApart) {
  const SyntheticMap world = MakeSyntheticMap({});
  const FrameFeaturesPtr a = world.See(PoseOnArc(0.0), {.flipped_bits = 10, .seed = 1}).features;
  const FrameFeaturesPtr b = world.See(PoseOnArc(1.0), {.flipped_bits = 10, .seed = 2}).features;
  FeatureDatabase database;
  const ImageMatches forward = database.MatchesOf(*a, *b);
  ImageMatches backward = database.MatchesOf(*b, *a);
  EXPECT_EQ(database.Searched(), 2) << "the order of two images counts";
  for (auto& [i, j] : backward) {
    std::swap(i, j);
  }
  EXPECT_TRUE(std::ranges::is_permutation(forward, backward));
  EXPECT_FALSE(forward.empty());
}

TEST(FeatureDatabase, DropsMatchesThatNoFundamentalMatrixExplains) {
  const SyntheticMap world = MakeSyntheticMap({});
  const FrameFeaturesPtr a = world.See(PoseOnArc(0.0), {.flipped_bits = 10, .seed = 1}).features;
  FrameFeatures scattered = *world.See(PoseOnArc(1.0), {.flipped_bits = 10, .seed = 2}).features;
  scattered.keypoints.resize(100);
  scattered.descriptors.resize(100);
  std::mt19937_64 random(3);
  for (Keypoint& keypoint : scattered.keypoints) {
    keypoint.raw_pixel = {std::uniform_real_distribution(0.0, 640.0)(random),
                          std::uniform_real_distribution(0.0, 480.0)(random)};
  }
  EXPECT_TRUE(FeatureDatabase().MatchesOf(*a, scattered).empty());
}

}  // namespace
}  // namespace sqslam
