#include "slam/mapping/place_recognizer.h"

#include <gtest/gtest.h>

#include "tests/support/synthetic_map.h"

namespace sqslam {
namespace {

using testing::MakeRingMap;
using testing::RandomWords;
using testing::SyntheticMap;

PlaceRecognizer Teach(SyntheticMap& ring, std::shared_ptr<const Vocabulary> words) {
  PlaceRecognizer places(ring.camera, {}, std::move(words));
  std::vector<KeyframeId> ids;
  for (const auto& [id, keyframe] : ring.map.Keyframes()) {
    ids.push_back(id);
  }
  for (const KeyframeId id : ids) {
    places.Add(ring.map.At(id));
  }
  return places;
}

TEST(PlaceRecognizer, KnowsThePlaceWhereTheRingCloses) {
  const testing::RingMapOptions options;
  SyntheticMap ring = MakeRingMap(options);
  const PlaceRecognizer places = Teach(ring, RandomWords());
  const auto place = places.Recognize({&ring.map}, 27);  // stands where keyframe 3 stood
  ASSERT_TRUE(place);
  EXPECT_NEAR(static_cast<double>(place->known), 3.0, 1.0);
  EXPECT_GE(place->confirmed.size(), 50U);
  EXPECT_NEAR(place->S_current_known.scale,
              std::exp(options.scale_drift * 15.0 * static_cast<double>(27 - place->known)), 0.02);
}

TEST(PlaceRecognizer, FindsNothingOnTheWayThere) {
  SyntheticMap ring = MakeRingMap({});
  const PlaceRecognizer places = Teach(ring, RandomWords());
  EXPECT_FALSE(places.Recognize({&ring.map}, 12));
}

TEST(PlaceRecognizer, KnowsPlacesOfOtherMaps) {
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

TEST(PlaceRecognizer, IsOffWithoutWords) {
  SyntheticMap ring = MakeRingMap({});
  const PlaceRecognizer places = Teach(ring, nullptr);
  EXPECT_FALSE(places.Recognize({&ring.map}, 27));
}

}  // namespace
}  // namespace sqslam
