#include "slam/mapping/loop_correction.h"

#include <gtest/gtest.h>

#include "slam/mapping/submap.h"
#include "tests/support/synthetic_map.h"

namespace sqslam {
namespace {

using testing::CenterError;
using testing::CountBrokenReferences;
using testing::MakeRingMap;
using testing::RingMapOptions;
using testing::SyntheticMap;

// Keyframe 24 stands exactly where keyframe 0 stood; keyframe 27 is the last.
constexpr KeyframeId kCurrent = 27;
constexpr KeyframeId kKnown = 3;

// The answer of a perfect recogniser: the two cameras are in the same place, and the unit of length has
// changed by the drift.
LoopCandidate PerfectPlace(const SyntheticMap& ring, const RingMapOptions& options) {
  LoopCandidate place;
  place.current = kCurrent;
  place.known = kKnown;
  place.S_current_known.scale = std::exp(options.scale_drift * 15.0 * (kCurrent - kKnown));
  const Keyframe& current = ring.map.At(kCurrent);
  const Keyframe& known = ring.map.At(kKnown);
  for (std::size_t i = 0; i < known.points.size(); ++i) {
    place.known_points.push_back(known.points[i]);
    place.confirmed.emplace_back(known.points[i], static_cast<int>(i));
  }
  EXPECT_EQ(current.points.size(), known.points.size());
  return place;
}

TEST(CorrectLoop, RemovesDriftOfTheRing) {
  const RingMapOptions options;
  SyntheticMap ring = MakeRingMap(options);
  const double before = CenterError(ring);
  const int points_before = ring.map.NumPoints();
  LoopEdges edges;
  CorrectLoop(ring.map, ring.camera, PerfectPlace(ring, options), edges);
  EXPECT_LT(CenterError(ring), before / 5.0);
  EXPECT_LT(ring.map.NumPoints(), points_before);
  EXPECT_EQ(CountBrokenReferences(ring.map), 0);
  EXPECT_EQ(edges, (LoopEdges{{kKnown, kCurrent}}));
  EXPECT_TRUE(ring.map.At(kCurrent).covisibility.contains(kKnown));
}

TEST(CorrectLoop, UpdatesScaleOfEachKeyframe) {
  const RingMapOptions options;
  SyntheticMap ring = MakeRingMap(options);
  LoopEdges edges;
  CorrectLoop(ring.map, ring.camera, PerfectPlace(ring, options), edges);
  // The unit of length had grown along the way; a frame anchored to the last keyframe must shrink
  // accordingly.
  EXPECT_NEAR(ring.map.At(kKnown).scale, 1.0, 1e-9);
  EXPECT_NEAR(ring.map.At(kCurrent).scale, std::exp(-options.scale_drift * 15.0 * (kCurrent - kKnown)), 0.01);
  EXPECT_LT(ring.map.At(20).scale, ring.map.At(10).scale);
}

TEST(CorrectLoop, ChangesNothingWithoutDrift) {
  const RingMapOptions options{.scale_drift = 0.0, .rotation_drift = 0.0};
  SyntheticMap ring = MakeRingMap(options);
  ASSERT_LT(CenterError(ring), 1e-9);
  LoopEdges edges;
  CorrectLoop(ring.map, ring.camera, PerfectPlace(ring, options), edges);
  EXPECT_LT(CenterError(ring), 1e-6);
}

// Something two metres before each keyframe, seen by it alone.
TEST(CorrectLoop, MovesLandmarksWithTheirKeyframes) {
  const RingMapOptions options;
  SyntheticMap ring = MakeRingMap(options);
  const LoopCandidate place = PerfectPlace(ring, options);
  std::vector<ObjectObservation> observations;
  for (const auto& [id, keyframe] : ring.map.Keyframes()) {
    ObjectObservation o;
    o.object_id = static_cast<int>(id);
    o.frame_index = keyframe.frame_index;
    o.detection = {"cup", 0.9, {300.0, 200.0, 50.0, 50.0}};
    o.T_map_camera = keyframe.T_camera_map.Inverse();
    o.centroid = o.T_map_camera * Eigen::Vector3d(0.0, 0.0, 2.0);
    observations.push_back(o);
  }
  Submap submap(0, std::make_unique<Map>(std::move(ring.map)), MapperOptions{});
  submap.Objects().AddObservations(observations);
  LoopEdges edges;
  submap.Deform([&](Map& map) { CorrectLoop(map, ring.camera, place, edges); });
  const auto view = submap.Objects().View();
  ASSERT_EQ(view->landmarks.size(), observations.size());
  for (const ObjectLandmarkView& landmark : view->landmarks) {
    const Keyframe& keyframe = submap.Map().At(landmark.id);
    const Eigen::Vector3d p_camera = keyframe.T_camera_map * landmark.centroids.mean;
    EXPECT_LT((p_camera - Eigen::Vector3d(0.0, 0.0, 2.0 * keyframe.scale)).norm(), 1e-9) << landmark.id;
  }
}

TEST(SimilarityOfMaps, MapsCurrentCameraToKnownOne) {
  const RingMapOptions options;
  const SyntheticMap ring = MakeRingMap(options);
  const LoopCandidate place = PerfectPlace(ring, options);
  const Sim3d S = SimilarityOfMaps(ring.map, ring.map, place);
  EXPECT_TRUE((S * ring.map.At(kCurrent).Center()).isApprox(ring.map.At(kKnown).Center(), 1e-9));
  const PointId current_point = ring.map.At(kCurrent).points[5];
  const PointId known_point = ring.map.At(kKnown).points[5];
  ASSERT_NE(current_point, known_point);
  EXPECT_LT((S * ring.map.Point(current_point).p_map - ring.map.Point(known_point).p_map).norm(), 0.1);
}

}  // namespace
}  // namespace sqslam
