#include "slam/objects/late_association.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "seen_landmark.h"
#include "slam/geometry/angles.h"
#include "slam/objects/landmark_geometry.h"
#include "test_camera.h"

namespace sqslam {
namespace {

using testing::CameraLookingAt;
using ::testing::ElementsAre;
using testing::ObservationOf;
using testing::TestCamera;
using ::testing::UnorderedElementsAre;

PosedSuperquadric BoxAt(double x, double y) {
  PosedSuperquadric box;
  box.shape = {{0.2, 0.15, 0.1}, 0.1, 0.1};
  box.T_map_object.translation = {x, y, 0.1};
  return box;
}

// A camera 3 m from the origin in the direction of the angle, degrees, that looks at it.
Rigid3d CameraFrom(double degrees) {
  const double angle = degrees * kRadiansPerDegree;
  return CameraLookingAt(Eigen::Vector3d::Zero(), {3.0 * std::cos(angle), 3.0 * std::sin(angle), 1.0});
}

// A landmark of the boxes that show the solid in some frames; frame i looks from 30 i degrees.
Landmark Fragment(const PosedSuperquadric& solid, const std::vector<int>& frames,
                  const std::string& label = "tv") {
  Landmark landmark;
  for (const int frame : frames) {
    ObjectObservation observation = ObservationOf(label, {}, frame);
    observation.T_map_camera = CameraFrom(30.0 * frame);
    observation.detection.box = *ProjectToBox(solid, observation.T_map_camera, TestCamera());
    observation.edge_free = {true, true, true, true};
    landmark.Add(observation);
  }
  return landmark;
}

std::vector<const Landmark*> Pointers(const std::vector<Landmark>& landmarks) {
  std::vector<const Landmark*> pointers;
  for (const Landmark& landmark : landmarks) {
    pointers.push_back(&landmark);
  }
  return pointers;
}

TEST(LateAssociation, GroupsSingleBoxesOfOnePlace) {
  std::vector<Landmark> fragments;
  for (int frame = 0; frame < 6; ++frame) {
    fragments.push_back(Fragment(BoxAt(0.0, 0.0), {frame}));
    if (frame < 4) {
      fragments.push_back(Fragment(BoxAt(0.8, 0.3), {frame}));
    }
  }
  EXPECT_THAT(AssociateFragments(Pointers(fragments), {}, TestCamera()).groups,
              ElementsAre(UnorderedElementsAre(0, 2, 4, 6, 8, 9), UnorderedElementsAre(1, 3, 5, 7)));
}

TEST(LateAssociation, GroupsNothingWhenBoxesShowDifferentThings) {
  std::vector<Landmark> fragments;
  for (int frame = 0; frame < 6; ++frame) {
    fragments.push_back(Fragment(BoxAt(0.35 * (frame - 3), 0.3 * ((frame * 5) % 7 - 3)), {frame}));
  }
  EXPECT_TRUE(AssociateFragments(Pointers(fragments), {}, TestCamera()).groups.empty());
  fragments = {Fragment(BoxAt(0.0, 0.0), {0}, "tv"), Fragment(BoxAt(0.0, 0.0), {1}, "cup"),
               Fragment(BoxAt(0.0, 0.0), {2}, "book")};
  EXPECT_TRUE(AssociateFragments(Pointers(fragments), {}, TestCamera()).groups.empty());
}

// Boxes of most of the image would agree on any place; they say nothing about the small ones.
TEST(LateAssociation, GroupsSmallBoxesAmongLargeOnes) {
  PosedSuperquadric wall = BoxAt(0.0, 0.0);
  wall.shape.half_size = {0.8, 0.8, 0.8};
  std::vector<Landmark> fragments;
  for (int frame = 0; frame < 4; ++frame) {
    fragments.push_back(Fragment(BoxAt(0.5, 0.0), {frame}));
    fragments.push_back(Fragment(wall, {frame + 6}));
  }
  EXPECT_THAT(AssociateFragments(Pointers(fragments), {}, TestCamera()).groups,
              ElementsAre(UnorderedElementsAre(0, 2, 4, 6)));
}

TEST(LateAssociation, TakesOneBoxAFrame) {
  const std::vector<Landmark> fragments = {Fragment(BoxAt(0.0, 0.0), {0, 1, 2}),
                                           Fragment(BoxAt(0.02, 0.0), {0}), Fragment(BoxAt(0.0, 0.0), {3})};
  EXPECT_THAT(AssociateFragments(Pointers(fragments), {}, TestCamera()).groups,
              ElementsAre(ElementsAre(0, 2)));
}

TEST(LateAssociation, FindsTheMappedObjectThatAFragmentShows) {
  std::vector<Landmark> mapped = {Fragment(BoxAt(0.8, 0.3), {0, 1, 2}), Fragment(BoxAt(0.0, 0.0), {0, 1, 2})};
  mapped[0].visible = BoxAt(0.8, 0.3);
  mapped[1].visible = BoxAt(0.0, 0.0);
  const auto found = [&](const Landmark& fragment) -> std::optional<std::size_t> {
    const auto shown = AssociateFragments(std::vector{&fragment}, Pointers(mapped), TestCamera()).shown;
    return shown.empty() ? std::nullopt : std::optional(shown.front().second);
  };
  EXPECT_EQ(found(Fragment(BoxAt(0.03, 0.0), {3, 4})), 1U);
  EXPECT_EQ(found(Fragment(BoxAt(0.03, 0.0), {3, 4}, "laptop")), 1U);
  EXPECT_EQ(found(Fragment(BoxAt(0.0, 0.8), {3, 4})), std::nullopt);
  EXPECT_EQ(found(Fragment(BoxAt(0.03, 0.0), {2, 3})), std::nullopt) << "has another box in frame 2";
}

}  // namespace
}  // namespace sqslam
