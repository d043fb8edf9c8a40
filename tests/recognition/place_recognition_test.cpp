// From images to places: the textured world of the tests, seen from other poses.
#include <gtest/gtest.h>

#include "slam/features/orb_extractor.h"
#include "slam/recognition/place_index.h"
#include "slam/recognition/vocabulary.h"
#include "tests/support/textured_world.h"

namespace sqslam::testing {
namespace {

// Three places: the camera looks at parts of the world that hardly overlap.
constexpr int kPlaces = 3;

Rigid3d PoseAt(int place, double aside) {
  const double yaw = (static_cast<double>(place) - 1.0) * 0.8;  // of 63 degrees that it sees
  return {Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY())),
          Eigen::Vector3d(aside, 0.5 * aside, aside)};
}

// Every texture of that world is of the same kind, and the vocabulary is small: other places score high too.
TEST(PlaceRecognition, RanksSamePlaceFirst) {
  const TexturedWorld world;
  OrbExtractor extractor({.num_features = 600});
  const auto descriptors_at = [&](const Rigid3d& pose) {
    const Frame frame = world.Render(0, pose);
    return extractor.Extract(frame.gray, frame.bgr, world.GetCamera()).descriptors;
  };
  std::vector<std::vector<Descriptor>> training;
  for (int place = 0; place < kPlaces; ++place) {
    for (const double aside : {-0.08, -0.04, 0.0}) {
      training.push_back(descriptors_at(PoseAt(place, aside)));
    }
  }
  const Vocabulary vocabulary = Vocabulary::Train(training, {.branching = 8, .depth = 3});
  PlaceIndex index;
  for (int place = 0; place < kPlaces; ++place) {
    index.Add(place, vocabulary.Transform(descriptors_at(PoseAt(place, 0.0))));
  }
  for (int place = 0; place < kPlaces; ++place) {
    const BagOfWords bag = vocabulary.Transform(descriptors_at(PoseAt(place, 0.06)));
    const auto candidates = index.Query({.bow = &bag,
                                         .exclude = {},
                                         .covisible = {},
                                         .min_score = 0.0,
                                         .min_shared_words = 0.0,
                                         .min_group_score = 0.0});
    ASSERT_FALSE(candidates.empty());
    EXPECT_EQ(candidates[0].id, place);
    if (candidates.size() > 1) {
      EXPECT_GT(candidates[0].score, 1.1 * candidates[1].score) << "place " << place;
    }
  }
}

}  // namespace
}  // namespace sqslam::testing
