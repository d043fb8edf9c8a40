#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "slam/estimation/two_view.h"
#include "slam/mapping/local_mapping.h"
#include "tests/support/synthetic_map.h"

namespace sqslam {
namespace {

using testing::CountBrokenReferences;
using testing::LargestReprojectionError;
using testing::MakeSyntheticMap;
using testing::PoseOnArc;
using testing::SyntheticMap;
using testing::SyntheticMapOptions;
using testing::WithOctave;

constexpr PointId kKnownPoints = 100;  // the other keypoints of all keyframes have no map point
constexpr KeyframeId kNewest = 3;
constexpr KeyframeId kNeighbour = 2;

SyntheticMap PartlyMapped(const SyntheticMapOptions& options) {
  SyntheticMap world = MakeSyntheticMap(options);
  for (PointId id = kKnownPoints; id < options.points; ++id) {
    world.map.RemovePoint(id);
  }
  for (KeyframeId id = 0; id <= kNewest; ++id) {
    world.map.UpdateCovisibility(id);
  }
  return world;
}

class PointCreation : public ::testing::Test {
 protected:
  std::vector<PointId> Create(const NewPointOptions& options = {}) {
    return CreateNewPoints(world_.map, world_.camera, kNewest, options);
  }
  static NewPointOptions WithOneNeighbour() {
    NewPointOptions options;
    options.neighbours = 1;
    return options;
  }
  // Lets the neighbour see the points from elsewhere, or in another way.
  void SetNeighbour(const Rigid3d& T_camera_map) {
    Keyframe& neighbour = world_.map.At(kNeighbour);
    neighbour.T_camera_map = T_camera_map;
    neighbour.features = world_.See(T_camera_map).features;
    ASSERT_EQ(neighbour.features->Size(), world_.points.size());
  }
  void MoveKeypoint(std::size_t keypoint, const Eigen::Vector2d& step) {
    Keyframe& neighbour = world_.map.At(kNeighbour);
    auto features = std::make_shared<FrameFeatures>(*neighbour.features);
    features->keypoints[keypoint].pixel += step;
    neighbour.features = features;
  }
  // The index of the point of the world that a new point is.
  std::size_t Shown(PointId id) const {
    return static_cast<std::size_t>(world_.map.Point(id).observations.front().keypoint);
  }
  double Error(PointId id) const { return (world_.map.Point(id).p_map - world_.points[Shown(id)]).norm(); }

  SyntheticMap world_ = PartlyMapped({.keyframes = 4});
};

TEST_F(PointCreation, RecoversTruthFromExactKeypoints) {
  const std::vector<PointId> created = Create();
  EXPECT_EQ(created.size(), 200U);
  for (const PointId id : created) {
    EXPECT_LT(Error(id), 1e-6);
    const MapPoint& point = world_.map.Point(id);
    EXPECT_EQ(point.first_keyframe, kNewest);
    ASSERT_EQ(point.observations.size(), 2U);
    EXPECT_EQ(point.observations[0].keyframe, kNewest);
    EXPECT_EQ(point.observations[0].keypoint, point.observations[1].keypoint);
    EXPECT_EQ(point.descriptor, world_.descriptors[Shown(id)]);
  }
  EXPECT_EQ(CountBrokenReferences(world_.map), 0);
  for (std::size_t i = 0; i < kKnownPoints; ++i) {
    EXPECT_EQ(world_.map.At(kNewest).points[i], static_cast<PointId>(i)) << "known ones are left alone";
  }
  EXPECT_TRUE(Create().empty()) << "all keypoints have their points now";
}

TEST_F(PointCreation, StaysWithinNoiseOfTheTruth) {
  constexpr double kNoise = 0.5;  // px
  world_ = PartlyMapped({.keyframes = 4, .points = 600, .pixel_noise = kNoise});
  const std::vector<PointId> created = Create();
  EXPECT_GT(created.size(), 450U);
  std::vector<double> deviations;
  for (const PointId id : created) {
    const MapPoint& point = world_.map.Point(id);
    const double depth = (world_.map.At(kNewest).T_camera_map * point.p_map).z();
    const double baseline = (world_.map.At(point.observations[0].keyframe).Center() -
                             world_.map.At(point.observations[1].keyframe).Center())
                                .norm();
    // Along the ray, of the disparity between two noisy keypoints.
    const double sigma = std::sqrt(2.0) * kNoise * depth * depth / (world_.camera.fx * baseline);
    deviations.push_back(Error(id) / sigma);
  }
  std::sort(deviations.begin(), deviations.end());
  EXPECT_LT(deviations[deviations.size() / 2], 1.0);
  EXPECT_LT(deviations.back(), 5.0);
  EXPECT_LT(LargestReprojectionError(world_.map, world_.camera), 2.5);  // chi-squared of two degrees: 2.45
}

TEST_F(PointCreation, NeedsBaseline) {
  SetNeighbour(PoseOnArc(2.99));  // 5 mm away
  NewPointOptions options = WithOneNeighbour();
  options.max_parallax_cos = 1.0;  // the rays say nothing against them
  EXPECT_TRUE(Create(options).empty());
  EXPECT_EQ(Create().size(), 200U) << "the next keyframe is far enough";
}

TEST_F(PointCreation, NeedsParallax) {
  NewPointOptions options = WithOneNeighbour();
  const Eigen::Vector3d center = world_.map.At(kNewest).Center();
  const Eigen::Vector3d other = world_.map.At(kNeighbour).Center();
  std::vector<double> cosines;
  for (std::size_t i = kKnownPoints; i < world_.points.size(); ++i) {
    cosines.push_back(CosParallax(world_.points[i], center, other));
  }
  std::sort(cosines.begin(), cosines.end());
  options.max_parallax_cos = 0.5 * (cosines[49] + cosines[50]);
  EXPECT_EQ(Create(options).size(), 50U);
}

TEST_F(PointCreation, RejectsKeypointsOffEpipolarLines) {
  MoveKeypoint(150, {0.0, 8.0});  // the lines are nearly level
  const std::vector<PointId> created = Create(WithOneNeighbour());
  EXPECT_EQ(created.size(), 199U);
  for (const PointId id : created) {
    EXPECT_NE(Shown(id), 150U);
  }
}

// Two points look the same; the epipolar lines say which is which.
TEST_F(PointCreation, MatchesAlongEpipolarLines) {
  for (const KeyframeId id : {kNewest, kNeighbour}) {
    auto features = std::make_shared<FrameFeatures>(*world_.map.At(id).features);
    features->descriptors[150] = features->descriptors[151];
    if (id == kNeighbour) {
      features->descriptors[150][0] ^= 3;  // the wrong one looks a little more alike
    }
    world_.map.At(id).features = features;
  }
  EXPECT_EQ(Create(WithOneNeighbour()).size(), 200U);
}

TEST_F(PointCreation, RejectsPointsBehindACamera) {
  MoveKeypoint(150, {120.0, 0.0});  // farther than a point at infinity would be
  MoveKeypoint(160, {-120.0, 0.0});
  for (const PointId id : Create(WithOneNeighbour())) {
    EXPECT_GT((world_.map.At(kNeighbour).T_camera_map * world_.map.Point(id).p_map).z(), 0.0);
    EXPECT_NE(Shown(id), 150U);
  }
}

TEST_F(PointCreation, NeedsScaleConsistentWithDistance) {
  Keyframe& neighbour = world_.map.At(kNeighbour);
  const FrameFeaturesPtr features = neighbour.features;
  neighbour.features = WithOctave(*features, 5);  // 2.5 times larger from the same distance
  EXPECT_TRUE(Create(WithOneNeighbour()).empty());
  neighbour.features = WithOctave(*features, 1);
  EXPECT_EQ(Create(WithOneNeighbour()).size(), 200U);
}

TEST_F(PointCreation, AvoidsTheEpipole) {
  world_ = PartlyMapped({.keyframes = 4, .points = 800});
  Rigid3d behind = PoseOnArc(kNewest);
  behind.translation.z() += 0.8;  // the camera has gone forward; the epipole is the image's centre
  SetNeighbour(behind);
  NewPointOptions options = WithOneNeighbour();
  options.max_parallax_cos = 1.0;
  std::set<std::size_t> shown;
  for (const PointId id : Create(options)) {
    shown.insert(Shown(id));
    EXPECT_LT(Error(id), 1e-5);
  }
  for (std::size_t i = kKnownPoints; i < world_.points.size(); ++i) {
    const Eigen::Vector2d pixel = world_.map.At(kNeighbour).features->keypoints[i].pixel;
    EXPECT_EQ(shown.contains(i), (pixel - Eigen::Vector2d(320.0, 240.0)).norm() > 10.0) << i;
  }
  EXPECT_LT(shown.size(), 700U);
}

TEST_F(PointCreation, CommutesWithASimilarity) {
  SyntheticMap moved = world_;
  const Sim3d S_new_old{
      0.3,
      Eigen::Quaterniond(Eigen::AngleAxisd(0.8, Eigen::Vector3d(1.0, 2.0, 3.0).normalized())),
      {3.0, -1.0, 7.0}};
  moved.map.Transform(S_new_old);
  const std::vector<PointId> created = Create();
  EXPECT_EQ(CreateNewPoints(moved.map, moved.camera, kNewest, {}).size(), created.size());
  for (const PointId id : moved.map.At(kNewest).points) {
    const MapPoint& point = moved.map.Point(id);
    const auto keypoint = static_cast<std::size_t>(
        std::find_if(point.observations.begin(), point.observations.end(), [](const Observation& o) {
          return o.keyframe == kNewest;
        })->keypoint);
    const PointId same = world_.map.At(kNewest).points[keypoint];
    EXPECT_LT((S_new_old * world_.map.Point(same).p_map - point.p_map).norm(), 1e-6);
  }
}

}  // namespace
}  // namespace sqslam
