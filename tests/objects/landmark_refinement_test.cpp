#include "slam/objects/landmark_refinement.h"

#include <gtest/gtest.h>

#include "slam/geometry/angles.h"
#include "slam/objects/landmark_estimation.h"
#include "slam/objects/landmark_geometry.h"
#include "tests/objects/box_scene.h"
#include "tests/objects/flat_surface.h"

namespace sqslam {
namespace {

using testing::BoxScene;
using testing::FlatSurface;

// Boxes of a box of the scene, and no points to speak of.
class RefineLandmarkTest : public ::testing::Test {
 protected:
  RefineLandmarkTest() {
    context_.options = &options_;
    context_.camera = scene_.camera;
    context_.upright = true;
    context_.supports = &supports_;
    context_.classes = &classes_;
    context_.thorough = true;
  }

  Landmark LandmarkOf(const PosedSuperquadric& solid) const {
    Landmark landmark;
    landmark.labels.Add("box", 1.0);
    landmark.observations = static_cast<int>(scene_.poses.size());
    for (std::size_t i = 0; i < scene_.poses.size(); ++i) {
      const Box2d box = *ProjectToBox(solid, scene_.poses[i], scene_.camera);
      landmark.views.push_back(
          {static_cast<std::int64_t>(i), scene_.poses[i], box, {true, true, true, true}});
    }
    for (int i = 0; i < 4; ++i) {
      const Eigen::Vector3d p = solid.T_map_object * Eigen::Vector3d(0.12, 0.1 * i - 0.15, 0.05 * i - 0.1);
      landmark.points.emplace_back(i, p);
      for (const std::size_t pose : {0, 13, 26, 39}) {
        landmark.votes[i].SeeInside(scene_.poses[pose].translation);
      }
    }
    return landmark;
  }

  const BoxScene scene_;
  const ObjectOptions options_;
  const ClassTable classes_;
  const SupportSurfaces supports_ = FlatSurface(0.0);
  EstimationContext context_;
};

// A few more boxes improve a landmark on the surface it stands on; none of them shows its lower end.
TEST_F(RefineLandmarkTest, StaysOnItsSupport) {
  Landmark landmark = LandmarkOf(scene_.truth);
  for (BoxView& view : landmark.views) {
    view.edge_free[kBottomEdge] = false;
  }
  landmark.refined = true;
  landmark.visible = landmark.superquadric = scene_.truth;
  landmark.support = 0.02;  // that of the surface, before the last bundle adjustment
  EXPECT_EQ(RefineLandmark(landmark, landmark.views, false, context_)->assumption.support,
            std::optional(0.0));
  const SupportSurfaces floor = FlatSurface(-0.7);
  context_.supports = &floor;  // the table was not found again
  EXPECT_EQ(RefineLandmark(landmark, landmark.views, false, context_)->assumption.support, landmark.support);
  const auto points = landmark.points;
  const PointLookup lookup = [&](std::int64_t& id) {
    return std::optional(points[static_cast<std::size_t>(id)].second);
  };
  context_.points = &lookup;
  context_.thorough = false;
  landmark.thorough_at = landmark.observations;
  EstimateLandmark(landmark, context_);
  EXPECT_TRUE(landmark.refined);
  EXPECT_EQ(landmark.support, std::optional(0.02));
  landmark.superquadric = StretchedTo(landmark.visible, -0.7);  // stands hidden behind a table
  EXPECT_EQ(RefineLandmark(landmark, landmark.views, false, context_)->assumption.support, std::nullopt);
}

}  // namespace
}  // namespace sqslam
