#include "slam/mapping/place_recognizer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>

#include "tests/support/synthetic_map.h"

namespace sqslam {
namespace {

using testing::ExactRing;
using testing::MakeRingMap;
using testing::RandomWords;
using testing::RingMapOptions;
using testing::SyntheticMap;

PlaceRecognizer Teach(SyntheticMap& ring, std::shared_ptr<const Vocabulary> words,
                      const LoopOptions& options = {}) {
  PlaceRecognizer places(ring.camera, options, std::move(words));
  std::vector<KeyframeId> ids;
  for (const auto& [id, keyframe] : ring.map.Keyframes()) {
    ids.push_back(id);
  }
  for (const KeyframeId id : ids) {
    places.Add(ring.map.At(id));
  }
  return places;
}

TEST(PlaceRecognizer, RecognizesPlaceWhereRingCloses) {
  const RingMapOptions options;
  SyntheticMap ring = MakeRingMap(options);
  const PlaceRecognizer places = Teach(ring, RandomWords());
  const auto place = places.Recognize({&ring.map}, 27);  // stands where keyframe 3 stood
  ASSERT_TRUE(place);
  EXPECT_NEAR(static_cast<double>(place->known), 3.0, 1.0);
  EXPECT_GE(place->confirmed.size(), 50U);
  EXPECT_NEAR(place->S_current_known.scale,
              std::exp(options.scale_drift * 15.0 * static_cast<double>(27 - place->known)), 0.02);
}

// The keyframe's image shows the place where keyframe 3 stood, but all neighbours saw something else.
TEST(PlaceRecognizer, NeedsConfirmationByNeighbours) {
  SyntheticMap ring = MakeRingMap({});
  std::vector<KeyframeId> neighbours = ring.map.At(27).BestCovisible(10);
  std::ranges::copy(ring.map.At(3).BestCovisible(10), std::back_inserter(neighbours));
  for (const KeyframeId id : neighbours) {
    auto changed = std::make_shared<FrameFeatures>(*ring.map.At(id).features);
    std::ranges::for_each(changed->descriptors, [](Descriptor& d) { std::ranges::reverse(d); });
    ring.map.At(id).features = changed;
  }
  EXPECT_FALSE(Teach(ring, RandomWords()).Recognize({&ring.map}, 27));
  LoopOptions alone;
  alone.confirming_neighbours = 0;
  EXPECT_TRUE(Teach(ring, RandomWords(), alone).Recognize({&ring.map}, 27));
}

// A camera that has only just begun a map has one neighbour to ask.
TEST(PlaceRecognizer, RecognizesPlaceFromMapOfTwoKeyframes) {
  SyntheticMap first = MakeRingMap(ExactRing());
  SyntheticMap second = MakeRingMap({.keyframes = 2, .first_id = 100});
  PlaceRecognizer places = Teach(first, RandomWords());
  places.Add(second.map.At(100));
  places.Add(second.map.At(101));
  EXPECT_TRUE(places.Recognize({&second.map, &first.map}, 101));
}

// A world in which one point in twenty has a descriptor of its own and the others share theirs with nineteen
// each: descriptors alone match few points. The map's points are inaccurate.
SyntheticMap RepetitiveRing() {
  constexpr std::size_t kAlike = 20;
  constexpr std::size_t kUnique = 75;
  constexpr double kNoise = 0.01;  // m
  SyntheticMap ring = MakeRingMap({.scale_drift = 0.0, .rotation_drift = 0.0});
  std::map<Descriptor, Descriptor> shown;
  for (std::size_t i = 0; i < ring.descriptors.size(); ++i) {
    shown[ring.descriptors[i]] = ring.descriptors[i < kUnique ? i : i - i % kAlike];
  }
  for (const auto& [id, keyframe] : ring.map.Keyframes()) {
    auto changed = std::make_shared<FrameFeatures>(*keyframe.features);
    std::ranges::for_each(changed->descriptors, [&](Descriptor& d) { d = shown.at(d); });
    ring.map.At(id).features = changed;
  }
  std::mt19937_64 random(5);
  std::normal_distribution<double> noise(0.0, kNoise);
  for (const MapPoint& point : ring.map.Points()) {
    ring.map.Point(point.id).p_map += Eigen::Vector3d(noise(random), noise(random), noise(random));
    ring.map.UpdateAppearance(point.id);
  }
  return ring;
}

TEST(PlaceRecognizer, RefinesSimilarityWithPredictedPoints) {
  SyntheticMap ring = RepetitiveRing();
  const PlaceRecognizer places = Teach(ring, RandomWords());
  double squared_error = 0.0;
  for (KeyframeId id = 24; id < 28; ++id) {  // each where another stood a lap ago
    const auto place = places.Recognize({&ring.map}, id);
    ASSERT_TRUE(place);
    ASSERT_EQ(place->known, id - 24);
    squared_error += place->S_current_known.translation.squaredNorm() / 4.0;
  }
  EXPECT_LT(std::sqrt(squared_error), 0.012);
}

// A third of the image is of the place before keyframe 2, and no more of its surroundings.
TEST(PlaceRecognizer, RejectsObjectThatStandsInTwoPlaces) {
  RingMapOptions options = ExactRing();
  options.repeated = true;
  SyntheticMap ring = MakeRingMap(options);
  EXPECT_FALSE(Teach(ring, RandomWords()).Recognize({&ring.map}, 14));
  LoopOptions credulous;
  credulous.min_relative_share = 0.0;
  EXPECT_TRUE(Teach(ring, RandomWords(), credulous).Recognize({&ring.map}, 14));
}

TEST(PlaceRecognizer, FindsNothingBeforeTheRingCloses) {
  SyntheticMap ring = MakeRingMap({});
  const PlaceRecognizer places = Teach(ring, RandomWords());
  EXPECT_FALSE(places.Recognize({&ring.map}, 12));
}

TEST(PlaceRecognizer, RecognizesPlacesOfOtherMaps) {
  SyntheticMap first = MakeRingMap({});
  // The same world in another scale; ids from 100 on, as a second submap of a run has them.
  SyntheticMap second = MakeRingMap({.scale_drift = 0.0, .rotation_drift = 0.0, .first_id = 100});
  second.map.Transform(Sim3d{2.5, Eigen::Quaterniond::Identity(), {1.0, 2.0, 3.0}});
  PlaceRecognizer places = Teach(first, RandomWords());
  places.Add(second.map.At(106));
  for (KeyframeId id = 20; id < 28; ++id) {
    places.Remove(id);  // leave one lap
  }
  const auto place = places.Recognize({&second.map, &first.map}, 106);
  ASSERT_TRUE(place);
  EXPECT_NEAR(static_cast<double>(place->known), 6.0, 1.0);
  EXPECT_NEAR(place->S_current_known.scale, 2.5, 0.15);
}

TEST(PlaceRecognizer, RecognizesNothingWithoutVocabulary) {
  SyntheticMap ring = MakeRingMap({});
  const PlaceRecognizer places = Teach(ring, nullptr);
  EXPECT_FALSE(places.Recognize({&ring.map}, 27));
}

}  // namespace
}  // namespace sqslam
