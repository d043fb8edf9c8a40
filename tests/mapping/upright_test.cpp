#include "slam/mapping/upright.h"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "slam/util/error.h"
#include "tests/support/synthetic_map.h"

namespace sqslam {
namespace {

using testing::LargestReprojectionError;
using testing::MakeSyntheticMap;
using testing::PlaneUp;
using testing::SyntheticMap;
using testing::Turn;

// A random cloud has slabs that pass for a weak plane.
constexpr GravityOptions kClearPlane{.min_support = 0.2};

constexpr double kDegree = std::numbers::pi / 180.0;

double AngleTo(const Eigen::Vector3d& direction, const Eigen::Vector3d& expected) {
  return std::atan2(direction.cross(expected).norm(), direction.dot(expected));
}

class UprightTest : public ::testing::Test {
 protected:
  // Updates and turns the map. Returns the angle of the turn; 0: none.
  double Update(UprightEstimator& upright, bool last = false) {
    const std::optional<Rigid3d> T_new_old = upright.Update(world_.map, no_objects_, world_.camera, last);
    if (!T_new_old) {
      return 0.0;
    }
    world_.map.Transform(Sim3d::FromRigid(*T_new_old));
    up_ = T_new_old->rotation * up_;
    return T_new_old->rotation.angularDistance(Eigen::Quaterniond::Identity());
  }
  void Tilt(double angle) {
    const Rigid3d tilt = Turn(angle, Eigen::Vector3d::UnitX());
    world_.map.Transform(Sim3d::FromRigid(tilt));
    up_ = tilt.rotation * up_;
  }

  // Returns five objects of which every keyframe shows ten edges along `vertical` (map frame).
  ObjectMapper EdgesAlong(const Eigen::Vector3d& vertical) const {
    constexpr int kObjects = 5;
    std::vector<ObjectObservation> seen;
    for (const auto& [id, keyframe] : world_.map.Keyframes()) {
      for (int object = 0; object < kObjects; ++object) {
        ObjectObservation& one = seen.emplace_back();
        one.object_id = object;
        one.frame_index = id;
        one.detection = {"box", 1.0, {100.0, 100.0, 200.0, 200.0}};
        one.T_map_camera = keyframe.T_camera_map.Inverse();
        for (PointId point = object; point < 10 * kObjects; point += kObjects) {
          const Eigen::Vector3d p_map = world_.map.Point(point).p_map;
          const Eigen::Vector3d a = keyframe.T_camera_map * p_map;
          const Eigen::Vector3d b = keyframe.T_camera_map * (p_map + 0.1 * a.z() * vertical);
          one.lines.push_back({world_.camera.Project(a), world_.camera.Project(b)});
        }
      }
    }
    ObjectMapper objects(ObjectOptions(), 1);
    objects.AddObservations(seen);
    return objects;
  }

  const ObjectMapper no_objects_{ObjectOptions(), 1};
  SyntheticMap world_ = MakeSyntheticMap({.keyframes = 8, .points = 400, .on_plane = 0.5});
  Eigen::Vector3d up_ = PlaneUp();  // the truth, in the map's present frame
};

TEST_F(UprightTest, TurnsGravityToMinusZ) {
  UprightEstimator upright("auto", kClearPlane, 1);
  EXPECT_FALSE(upright.Known());
  EXPECT_TRUE(upright.FindSurfaces(world_.map).All().empty());
  const double before = LargestReprojectionError(world_.map, world_.camera);
  EXPECT_GT(Update(upright), 0.3);
  EXPECT_LT(AngleTo(up_, Eigen::Vector3d::UnitZ()), 1e-3);
  EXPECT_NEAR(LargestReprojectionError(world_.map, world_.camera), before, 1e-6);
  EXPECT_TRUE(upright.Known());
  ASSERT_TRUE(upright.SupportHeight());
  EXPECT_NEAR(*upright.SupportHeight(), 0.0, 1e-3);
  EXPECT_FALSE(upright.FindSurfaces(world_.map).All().empty());
}

TEST_F(UprightTest, FindsGravityInNoisyMap) {
  std::mt19937 random(2);
  std::normal_distribution<double> noise(0.0, 0.005);
  for (const MapPoint& point : world_.map.Points()) {
    world_.map.Point(point.id).p_map += Eigen::Vector3d(noise(random), noise(random), noise(random));
  }
  UprightEstimator upright("auto", kClearPlane, 1);
  Update(upright);
  EXPECT_LT(AngleTo(up_, Eigen::Vector3d::UnitZ()), 0.5 * kDegree);
}

TEST_F(UprightTest, TurnsAgainOnlyByTheDifference) {
  UprightEstimator upright("auto", kClearPlane, 1);
  Update(upright);
  EXPECT_EQ(Update(upright), 0.0);
  Tilt(0.1 * kDegree);
  EXPECT_EQ(Update(upright), 0.0) << "too little to turn a map for";
  Tilt(2.0 * kDegree);
  EXPECT_NEAR(Update(upright), 2.1 * kDegree, 0.1 * kDegree);
  EXPECT_LT(AngleTo(up_, Eigen::Vector3d::UnitZ()), 1e-3);
}

TEST_F(UprightTest, KeepsEstimateWithMoreEvidence) {
  UprightEstimator upright("auto", kClearPlane, 1);
  Update(upright);
  // A later map shows another plane, by far fewer points.
  world_ = MakeSyntheticMap({.keyframes = 8, .points = 120, .on_plane = 0.3});
  UprightEstimator fresh("auto", kClearPlane, 1);
  ASSERT_TRUE(fresh.Update(world_.map, no_objects_, world_.camera, false)) << "which would do alone";
  EXPECT_FALSE(upright.Update(world_.map, no_objects_, world_.camera, false));
}

TEST_F(UprightTest, DoesNotTakeRampForFloor) {
  const Eigen::Vector3d vertical = Eigen::AngleAxisd(6.0 * kDegree, PlaneUp().unitOrthogonal()) * PlaneUp();
  UprightEstimator upright("auto", kClearPlane, 1);
  const std::optional<Rigid3d> T_new_old =
      upright.Update(world_.map, EdgesAlong(vertical), world_.camera, false);
  ASSERT_TRUE(T_new_old);
  EXPECT_LT(AngleTo(T_new_old->rotation * vertical, Eigen::Vector3d::UnitZ()), 0.3 * kDegree);
}

TEST_F(UprightTest, IgnoresEdgesWhenPlaneIsLevel) {
  UprightEstimator alone("auto", kClearPlane, 1);
  UprightEstimator with_edges("auto", kClearPlane, 1);
  const auto expected = alone.Update(world_.map, no_objects_, world_.camera, false);
  const auto turn = with_edges.Update(world_.map, EdgesAlong(PlaneUp()), world_.camera, false);
  ASSERT_TRUE(expected && turn);
  EXPECT_EQ(turn->rotation.coeffs(), expected->rotation.coeffs());
}

TEST_F(UprightTest, TrustsOnlyPointsSeenByThreeKeyframes) {
  for (PointId id = 0; id < 200; ++id) {  // those on the plane
    for (KeyframeId keyframe = 2; keyframe < 8; ++keyframe) {
      world_.map.RemoveObservation(id, keyframe);
    }
  }
  UprightEstimator upright("auto", kClearPlane, 1);
  EXPECT_EQ(Update(upright), 0.0);
  EXPECT_FALSE(upright.Known());
}

TEST_F(UprightTest, FindsNothingWithoutPlane) {
  world_ = MakeSyntheticMap({.keyframes = 8, .points = 400});
  UprightEstimator upright("auto", kClearPlane, 1);
  EXPECT_FALSE(upright.Update(world_.map, no_objects_, world_.camera, true));
  EXPECT_FALSE(upright.Known());
  EXPECT_FALSE(upright.SupportHeight());
}

TEST_F(UprightTest, EstimatesLessOftenInOldMap) {
  world_ = MakeSyntheticMap({.keyframes = 14, .points = 400, .on_plane = 0.5});
  up_ = PlaneUp();
  UprightEstimator upright("auto", kClearPlane, 1);
  Update(upright);
  Tilt(2.0 * kDegree);
  EXPECT_EQ(Update(upright), 0.0) << "13 keyframes after the first";
  EXPECT_NEAR(Update(upright, true), 2.0 * kDegree, 0.1 * kDegree) << "but always at the end";
}

TEST_F(UprightTest, TurnsOnceByGivenGravity) {
  const auto turn = [&](const std::string& gravity) {
    UprightEstimator upright(gravity, {}, 1);
    const std::optional<Rigid3d> T_new_old = upright.Update(world_.map, no_objects_, world_.camera, false);
    EXPECT_TRUE(T_new_old && upright.Known());
    EXPECT_FALSE(upright.Update(world_.map, no_objects_, world_.camera, true));
    return T_new_old.value_or(Rigid3d());
  };
  const Eigen::Vector3d down = -Eigen::Vector3d::UnitZ();
  EXPECT_LT(AngleTo(turn("level-start").rotation * Eigen::Vector3d::UnitY(), down), 1e-9);
  EXPECT_LT(AngleTo(turn("[0, 1, 0.3]").rotation * Eigen::Vector3d(0.0, 1.0, 0.3), down), 1e-9);
  EXPECT_LT(AngleTo(turn(" [ -0.2,4 , 1 ] ").rotation * Eigen::Vector3d(-0.2, 4.0, 1.0), down), 1e-9);
}

TEST_F(UprightTest, RejectsInvalidGravity) {
  for (const char* text : {"", "up", "Auto", "[0, 0, 0]", "[0, 1]", "[0, 1, nan]", "0, 1, 0"}) {
    EXPECT_THROW(UprightEstimator(text, {}, 1), UsageError) << text;
  }
}

}  // namespace
}  // namespace sqslam
