#include "render/scene/clip_plane.h"

#include <gtest/gtest.h>

#include <numbers>

#include "hand_made_map.h"

namespace sqslam {
namespace {

const SceneFocus kFocus = [] {
  SceneFocus focus;
  focus.center = {1.0, 2.0, 3.0};
  focus.radius = 2.0;
  return focus;
}();

TEST(ClipPlaneTest, FollowsStyle) {
  EXPECT_FALSE(MakeClipPlane({}, kFocus, {}).has_value());
  const auto z = MakeClipPlane({.axis = ClipAxis::kZ, .offset = 0.25}, kFocus, {});
  ASSERT_TRUE(z);
  EXPECT_TRUE(z->Keeps({9.0, 9.0, 3.4}));
  EXPECT_FALSE(z->Keeps({1.0, 2.0, 3.6}));
  const auto flipped = MakeClipPlane({.axis = ClipAxis::kZ, .offset = 0.25, .flip = true}, kFocus, {});
  EXPECT_FALSE(flipped->Keeps({9.0, 9.0, 3.4}));
  EXPECT_TRUE(flipped->Keeps({1.0, 2.0, 3.6}));
}

TEST(ClipPlaneTest, CutsTowardsCameraWhenAxisIsView) {
  ViewCamera camera;
  camera.position = {1.0, -8.0, 3.0};
  camera.focal_point = {1.0, 0.0, 3.0};
  const auto plane = MakeClipPlane({.axis = ClipAxis::kView}, kFocus, camera);
  ASSERT_TRUE(plane);
  EXPECT_FALSE(plane->Keeps({1.0, 1.9, 3.0}));
  EXPECT_TRUE(plane->Keeps({1.0, 2.1, 3.0}));
}

// The farthest point of the surface, found among many, is what decides.
TEST(ClipPlaneTest, FindsSolidsThatReachAcross) {
  for (const double e1 : {0.1, 0.7, 1.0, 1.9}) {
    for (const double e2 : {0.1, 1.0, 1.6}) {
      PosedSuperquadric solid{{{0.3, 0.2, 0.5}, e1, e2}, {}};
      solid.T_map_object.translation = {1.0, -2.0, 0.5};
      solid.T_map_object.rotation = Eigen::AngleAxisd(0.4, Eigen::Vector3d(1.0, 2.0, 0.5).normalized());
      const Eigen::Vector3d normal = Eigen::Vector3d(0.3, -0.5, 0.8).normalized();
      double least = 1e9;
      constexpr int kSteps = 400;
      for (int i = 0; i <= kSteps; ++i) {
        for (int k = 0; k < kSteps; ++k) {
          const double eta = std::numbers::pi * (static_cast<double>(i) / kSteps - 0.5);
          const double omega = 2.0 * std::numbers::pi * (static_cast<double>(k) / kSteps - 0.5);
          least = std::min(least, normal.dot(solid.T_map_object * solid.shape.PointAt(eta, omega)));
        }
      }
      EXPECT_TRUE((ClipPlane{normal, least + 0.003}.KeepsSomeOf(solid))) << e1 << " " << e2;
      EXPECT_FALSE((ClipPlane{normal, least - 0.003}.KeepsSomeOf(solid))) << e1 << " " << e2;
    }
  }
}

}  // namespace
}  // namespace sqslam
