#include "slam/objects/landmark_refinement.h"

#include <gtest/gtest.h>

#include "dense_box_scene.h"
#include "slam/geometry/angles.h"
#include "slam/objects/landmark_geometry.h"

namespace sqslam {
namespace {

using testing::DenseBoxScene;

TEST(IsBottomSeen, AsksForAThirdOfTheViews) {
  std::vector<BoxView> views(9);
  for (BoxView& view : views) {
    view.edge_free = {true, true, true, false};
  }
  views[0].edge_free[3] = views[1].edge_free[3] = true;
  EXPECT_FALSE(IsBottomSeen(views));
  views[2].edge_free[3] = true;
  EXPECT_TRUE(IsBottomSeen(views));
}

// Boxes of a turned box, and no points to speak of: what is given goes before what they say.
TEST(RefineLandmark, KeepsToPartsThatAreGiven) {
  const DenseBoxScene scene;
  PosedSuperquadric turned = scene.truth;
  turned.T_map_object.rotation = Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ());
  Landmark landmark;
  landmark.labels.Add("box", 1.0);
  landmark.observations = static_cast<int>(scene.poses.size());
  for (std::size_t i = 0; i < scene.poses.size(); ++i) {
    const Box2d box = *ProjectToBox(turned, scene.poses[i], scene.camera);
    landmark.views.push_back({static_cast<std::int64_t>(i), scene.poses[i], box, {true, true, true, true}});
  }
  for (int i = 0; i < 4; ++i) {
    const Eigen::Vector3d p = turned.T_map_object * Eigen::Vector3d(0.12, 0.1 * i - 0.15, 0.05 * i - 0.1);
    landmark.points.emplace_back(i, p);
    landmark.votes[i].SeeInside(scene.poses.front().translation);
    landmark.votes[i].SeeInside(scene.poses.back().translation);
  }
  const ObjectOptions options;
  const SupportSurfaces supports = SupportSurfaces::Everywhere(0.0);
  const ClassPriors classes;
  EstimationContext context;
  context.options = &options;
  context.camera = scene.camera;
  context.upright = true;
  context.supports = &supports;
  context.classes = &classes;
  context.thorough = true;
  const auto fit = [&] { return *RefineLandmark(landmark, landmark.views, true, context); };
  const auto yaw = [](const StandingFit& f) {
    return WrapQuarter(YawOf(f.superquadric.T_map_object.rotation));
  };
  EXPECT_NEAR(yaw(fit()), 0.3, 0.05);
  context.given.yaw = 0.0;
  EXPECT_NEAR(yaw(fit()), 0.0, 0.05);
  context.given = {};
  context.given.support = -0.05;
  EXPECT_EQ(fit().support, std::optional(-0.05));
  context.given = {};
  context.given.kind = ShapeKind::kCylinder;
  const Superquadric round = fit().superquadric.shape;
  EXPECT_EQ(NearestKind(round.e1, round.e2), ShapeKind::kCylinder);
}

}  // namespace
}  // namespace sqslam
