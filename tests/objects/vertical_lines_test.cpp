#include "slam/objects/vertical_lines.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "slam/geometry/angles.h"
#include "test_camera.h"

namespace sqslam {
namespace {

using testing::TestCamera;

// A camera that stands to the left or right of the origin and looks down at it by 30 degrees.
Rigid3d LookDownFrom(double azimuth) {
  const Eigen::Vector3d forward(std::cos(azimuth) * 0.866, std::sin(azimuth) * 0.866, -0.5);
  const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitZ()).normalized();
  Eigen::Matrix3d R;
  R << right, forward.cross(right), forward;
  return {Eigen::Quaterniond(R), -2.0 * forward};
}

LineSegment ImageOfLine(const Rigid3d& T_map_camera, const Eigen::Vector3d& p, const Eigen::Vector3d& q,
                        std::mt19937& random) {
  std::normal_distribution<double> noise(0.0, 0.5);
  const Rigid3d T_camera_map = T_map_camera.Inverse();
  const auto pixel = [&](const Eigen::Vector3d& x) {
    return Eigen::Vector2d(TestCamera().Project(T_camera_map * x) +
                           Eigen::Vector2d(noise(random), noise(random)));
  };
  return {pixel(p), pixel(q)};
}

// Edges of upright boxes with every yaw, and as many lines in any direction, of each of five objects.
std::vector<std::vector<LineView>> EdgesOfRoom(bool with_vertical_edges) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-0.5, 0.5);
  std::vector<std::vector<LineView>> room(5);
  for (std::vector<LineView>& object : room) {
    for (int i = 0; i < 20; ++i) {
      LineView view{LookDownFrom(0.05 * i), {}};
      for (int k = 0; k < 5; ++k) {
        const Eigen::Vector3d p(uniform(random), uniform(random), uniform(random));
        const double yaw = 6.0 * uniform(random);
        const Eigen::Vector3d along(std::cos(yaw), std::sin(yaw), 0.0);
        const Eigen::Vector3d any(uniform(random), uniform(random), uniform(random));
        if (with_vertical_edges) {
          view.lines.push_back(ImageOfLine(view.T_map_camera, p, p + 0.3 * Eigen::Vector3d::UnitZ(), random));
        }
        view.lines.push_back(ImageOfLine(view.T_map_camera, p, p + 0.3 * along, random));
        view.lines.push_back(ImageOfLine(view.T_map_camera, p, p + 0.4 * any, random));
      }
      object.push_back(std::move(view));
    }
  }
  return room;
}

// The edges of a chair's back, which lean by 8 degrees.
std::vector<LineView> LeaningEdges() {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> uniform(-0.5, 0.5);
  std::vector<LineView> views;
  for (int i = 0; i < 20; ++i) {
    LineView view{LookDownFrom(0.05 * i), {}};
    for (int k = 0; k < 40; ++k) {
      const Eigen::Vector3d p(uniform(random), uniform(random), uniform(random));
      view.lines.push_back(ImageOfLine(view.T_map_camera, p, p + Eigen::Vector3d(0.042, 0.0, 0.297), random));
    }
    views.push_back(std::move(view));
  }
  return views;
}

double DegreesOff(const Eigen::Vector3d& up) { return std::acos(std::min(1.0, up.z())) * kDegreesPerRadian; }

TEST(VerticalFromLines, FindsVerticalWhenThePlaneLeans) {
  const std::vector<std::vector<LineView>> room = EdgesOfRoom(true);
  for (const double lean : {-6.0, 0.0, 3.0, 6.0}) {
    const double angle = lean * kRadiansPerDegree;
    const Eigen::Vector3d plane(std::sin(angle) * 0.6, std::sin(angle) * 0.8, std::cos(angle));
    const auto edges = VerticalFromLines(room, TestCamera(), plane);
    ASSERT_TRUE(edges);
    EXPECT_LT(DegreesOff(edges->up), 0.3) << lean;
    EXPECT_EQ(edges->gain > 5.0, lean != 0.0) << lean << ": " << edges->gain;
  }
}

TEST(VerticalFromLines, GivesEachObjectOneVote) {
  std::vector<std::vector<LineView>> room = EdgesOfRoom(true);
  room.push_back(LeaningEdges());
  room.push_back(LeaningEdges());
  const auto edges = VerticalFromLines(room, TestCamera(), Eigen::Vector3d::UnitZ());
  ASSERT_TRUE(edges);
  EXPECT_LT(DegreesOff(edges->up), 0.3);
}

TEST(VerticalFromLines, ReturnsNothingWithoutVerticalEdgesOrWithFewObjects) {
  std::vector<std::vector<LineView>> room = EdgesOfRoom(true);
  EXPECT_FALSE(VerticalFromLines({}, TestCamera(), Eigen::Vector3d::UnitZ()));
  room.resize(2);
  EXPECT_FALSE(VerticalFromLines(room, TestCamera(), Eigen::Vector3d::UnitZ()));
  EXPECT_FALSE(VerticalFromLines(EdgesOfRoom(false), TestCamera(), Eigen::Vector3d::UnitZ()));
}

// A rotation of the map turns the result with it.
TEST(VerticalFromLines, CommutesWithRotation) {
  std::vector<std::vector<LineView>> room = EdgesOfRoom(true);
  const Eigen::Vector3d plane = Eigen::Vector3d(0.05, -0.03, 1.0).normalized();
  const auto edges = VerticalFromLines(room, TestCamera(), plane);
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1.0, 2.0, -0.5).normalized()));
  for (std::vector<LineView>& object : room) {
    for (LineView& view : object) {
      view.T_map_camera = Rigid3d{turn, Eigen::Vector3d(1.0, 0.0, 2.0)} * view.T_map_camera;
    }
  }
  const auto turned = VerticalFromLines(room, TestCamera(), turn * plane);
  ASSERT_TRUE(edges && turned);
  EXPECT_LT((turn * edges->up - turned->up).norm(), 0.3 * kRadiansPerDegree) << "by its grid";
}

}  // namespace
}  // namespace sqslam
