#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <vector>

#include "refinement_scene.h"
#include "slam/objects/object_class.h"
#include "solid_overlap.h"

namespace sqslam {
namespace {

using testing::Bottom;
using testing::InputOf;
using testing::SolidIoU;
using testing::SyntheticDesk;

constexpr double kWideBaseline = 1e9;  // map units, of points whose depth is as certain as the rest

TEST(RefineJointly, RecoversSizeFromSilhouettesAlone) {
  const SyntheticDesk desk(1);
  const PosedSuperquadric truth = desk.Objects()[5].superquadric;
  PosedSuperquadric start = truth;
  start.shape.half_size = {0.06, 0.06, 0.05};
  start.shape.e1 = start.shape.e2 = 0.4;
  start.T_map_object.translation += Eigen::Vector3d(0.02, -0.03, 0.01);
  RefinementInput input = InputOf(desk, truth);
  input.yaws = {{35.0 * M_PI / 180.0, 5.0 * M_PI / 180.0, 1.0}};
  input.assumption.support = 0.0;
  const RefinementResult result = RefineJointly(start, input, RefinementOptions());
  EXPECT_GT(SolidIoU(result.superquadric, truth), 0.85);
}

TEST(RefineJointly, BalancesTooLargeAndTooSmallBoxesWhenNothingIsHidden) {
  const SyntheticDesk desk(1);
  const PosedSuperquadric truth = desk.Objects()[5].superquadric;
  RefinementInput input = InputOf(desk, truth);
  input.yaws = {{35.0 * M_PI / 180.0, 5.0 * M_PI / 180.0, 1.0}};
  input.assumption.support = 0.0;
  for (std::size_t i = 0; i < input.views.size(); ++i) {
    Box2d& box = input.views[i].box;
    const double factor = i % 2 == 0 ? 1.06 : 0.94;
    const Eigen::Vector2d centre = box.Center();
    box = {centre.x() - 0.5 * factor * box.width, centre.y() - 0.5 * factor * box.height, factor * box.width,
           factor * box.height};
  }
  const Superquadric shape = RefineJointly(truth, input, RefinementOptions()).superquadric.shape;
  EXPECT_NEAR(std::cbrt(shape.Volume() / truth.shape.Volume()), 1.0, 0.03);
  for (SilhouetteView& view : input.views) {
    view.edge_exact[kBottomEdge] = false;  // then the smaller boxes may be cut short
  }
  EXPECT_GT(RefineJointly(truth, input, RefinementOptions()).superquadric.shape.Volume(), shape.Volume());
}

Box2d BoxAround(const std::vector<Eigen::Vector3d>& points, const Rigid3d& T_map_camera,
                const Camera& camera) {
  Eigen::Array2d low = Eigen::Array2d::Constant(1e9);
  Eigen::Array2d high = -low;
  for (const Eigen::Vector3d& p : points) {
    const Eigen::Array2d pixel = camera.Project(T_map_camera.Inverse() * p).array();
    low = low.min(pixel);
    high = high.max(pixel);
  }
  return {low.x(), low.y(), high.x() - low.x(), high.y() - low.y()};
}

// Points on a solid of revolution that is narrower at its ends, as share of the width in its middle.
std::vector<Eigen::Vector3d> PointsOfVase(const PosedSuperquadric& hull, const Eigen::Vector2d& tapers) {
  std::vector<Eigen::Vector3d> points;
  const Eigen::Vector3d& half = hull.shape.half_size;
  for (int i = 0; i <= 20; ++i) {
    for (int k = 0; k < 90; ++k) {
      const double height = 0.1 * i - 1.0;
      const double width = 1.0 - (1.0 - tapers[height > 0.0 ? 1 : 0]) * std::abs(height);
      const double angle = 2.0 * M_PI * k / 90;
      points.push_back(hull.T_map_object * Eigen::Vector3d(width * half.x() * std::cos(angle),
                                                           width * half.y() * std::sin(angle),
                                                           height * half.z()));
    }
  }
  return points;
}

TEST(RefineJointly, FitsWidthOfAVaseAtItsMiddle) {
  const SyntheticDesk desk(1);
  PosedSuperquadric hull = desk.Objects()[5].superquadric;
  hull.shape = {{0.06, 0.06, 0.11}, 0.15, 1.0};
  hull.T_map_object.translation.z() = 0.11;
  RefinementInput input = InputOf(desk, hull);
  for (SilhouetteView& view : input.views) {
    view.box = BoxAround(PointsOfVase(hull, {0.5, 0.6}), view.T_map_camera, desk.Camera());
  }
  input.assumption.support = 0.0;
  RefinementOptions options;
  const auto overlap = [&] { return SolidIoU(RefineJointly(hull, input, options).superquadric, hull); };
  EXPECT_GT(overlap(), 0.93);
  options.taper_sigma = 0.0;
  EXPECT_LT(overlap(), 0.85);
}

// A diamond explains the boxes of a vase nearly as well, and is wider.
TEST(RefineJointly, KeepsRoundObjectsRound) {
  const SyntheticDesk desk(1);
  PosedSuperquadric diamond = desk.Objects()[0].superquadric;
  diamond.shape = {{0.06, 0.06, 0.12}, 0.15, 1.6};
  diamond.T_map_object.translation.z() = 0.12;
  RefinementInput input = InputOf(desk, diamond);
  input.assumption.support = 0.0;
  PosedSuperquadric start = diamond;
  start.shape.e2 = 1.0;
  EXPECT_NEAR(RefineJointly(start, input, RefinementOptions()).superquadric.shape.e2, 1.0, 0.05);
}

TEST(RefineParts, WidensCupToTheSideOfItsHandle) {
  const SyntheticDesk desk(1);
  PosedSuperquadric body = desk.Objects()[5].superquadric;
  body.shape = {{0.042, 0.042, 0.048}, 0.1, 1.0};
  body.T_map_object.translation.z() = 0.048;
  std::vector<Eigen::Vector3d> points = PointsOfVase(body, {1.0, 1.0});
  for (const double z : {-0.024, 0.024}) {
    points.push_back(body.T_map_object * Eigen::Vector3d(0.072, 0.0, z));
  }
  PosedSuperquadric hull = body;
  hull.shape.half_size.x() = 0.057;
  hull.T_map_object.translation = body.T_map_object * Eigen::Vector3d(0.015, 0.0, 0.0);
  RefinementInput input = InputOf(desk, body);
  for (SilhouetteView& view : input.views) {
    view.box = BoxAround(points, view.T_map_camera, desk.Camera());
  }
  input.assumption.support = 0.0;
  PosedSuperquadric start = body;  // its yaw says nothing
  start.T_map_object.rotation = Eigen::AngleAxisd(1.0, Eigen::Vector3d::UnitZ());
  const RefinementResult round = RefineJointly(start, input, RefinementOptions());
  EXPECT_LT(SolidIoU(round.superquadric, hull), 0.85);
  EXPECT_FALSE(RefineParts(start, SolidKind::kCylinder, input, RefinementOptions()));
  input.prior.parts = ClassTable::Named("default").Of("cup").parts;
  const std::optional<RefinementResult> cup =
      RefineParts(start, SolidKind::kCylinder, input, RefinementOptions());
  ASSERT_TRUE(cup);
  EXPECT_GT(SolidIoU(cup->superquadric, hull), 0.92);
  EXPECT_LT(cup->cost, round.cost);
}

// Boxes of a seat with a back, seen from above: the hull over its seat holds air.
TEST(RefineParts, FindsHullOfChairThatOneSolidDoesNotFit) {
  const SyntheticDesk desk(1);
  PosedSuperquadric hull = desk.Objects()[5].superquadric;
  hull.shape = {{0.08, 0.075, 0.14}, 0.1, 0.1};
  hull.T_map_object.translation.z() = 0.14;
  RefinementInput input;
  input.camera = desk.Camera();
  input.prior.parts = ClassTable::Named("default").Of("chair").parts;
  const std::vector<SolidPart> parts =
      PartsWith(input.prior.parts.front(), {0.5, 0.1, 0.15, 0.15}, hull.shape.half_size, 3);
  for (int frame = 0; frame < SyntheticDesk::kFrames; frame += 2) {
    const Rigid3d pose = desk.Pose(frame);
    input.views.push_back({pose, *ProjectToBox(hull, parts, pose, desk.Camera()), {true, true, true, true}});
  }
  input.assumption.support = 0.0;
  const RefinementResult solid = RefineJointly(hull, input, RefinementOptions());
  const std::optional<RefinementResult> fit =
      RefineParts(solid.superquadric, SolidKind::kCuboid, input, RefinementOptions());
  ASSERT_TRUE(fit);
  EXPECT_GT(SolidIoU(fit->superquadric, hull), 0.9);
  EXPECT_GT(SolidIoU(fit->superquadric, hull), SolidIoU(solid.superquadric, hull) + 0.05);
  EXPECT_LT(fit->cost, solid.cost);
  EXPECT_EQ(fit->parts.size(), parts.size());
}

TEST(RefineParts, HangsPanelOnlyWithoutSupport) {
  const SyntheticDesk desk(1);
  const PosedSuperquadric panel = desk.Objects()[5].superquadric;
  RefinementInput input = InputOf(desk, panel);
  input.prior.parts = {ClassTable::Named("default").Of("tv").parts.front()};
  ASSERT_TRUE(input.prior.parts.front().hangs);
  input.assumption.support = 0.0;
  EXPECT_FALSE(RefineParts(panel, SolidKind::kCuboid, input, RefinementOptions()));
  input.assumption = {.cost = 4.0};
  const double hanging =
      RefineParts(panel, SolidKind::kCuboid, input, RefinementOptions())->cost + input.assumption.cost;
  input.assumption.cost = 0.0;
  EXPECT_NEAR(hanging, RefineParts(panel, SolidKind::kCuboid, input, RefinementOptions())->cost, 1e-9)
      << "needs no support";
}

TEST(RefineJointly, GivesOneCostFromAllStartsThatConverge) {
  const SyntheticDesk desk(1);
  const PosedSuperquadric truth = desk.Objects()[5].superquadric;
  RefinementInput input = InputOf(desk, truth);
  input.yaws = {{35.0 * M_PI / 180.0, 5.0 * M_PI / 180.0, 1.0}};
  input.assumption.support = 0.0;
  input.assumption.lowest = 0.0;
  for (int i = 0; i < 60; ++i) {
    input.points.push_back({truth.T_map_object * truth.shape.PointAt(-1.2 + 0.04 * i, -3.0 + 0.1 * i),
                            desk.Pose(0).translation, 0.5});
  }
  RefinementOptions options;
  options.max_iterations = 200;
  options.cost_tolerance = 1e-9;
  const auto from = [&](double factor) {
    PosedSuperquadric start = truth;
    start.shape.half_size *= factor;
    return RefineJointly(start, input, options);
  };
  const RefinementResult small = from(0.8);
  const RefinementResult large = from(1.25);
  ASSERT_GT(SolidIoU(small.superquadric, large.superquadric), 0.99);
  EXPECT_NEAR(small.cost, large.cost, 0.02);
}

TEST(RefineJointly, KeepsObjectBehindItsPoints) {
  const SyntheticDesk desk(1);
  const PosedSuperquadric truth = desk.Objects()[0].superquadric;
  RefinementInput input = InputOf(desk, truth);
  input.assumption.support = 0.0;
  for (SilhouetteView& view : input.views) {
    view.edge_exact = {};  // nothing but the points tells where it ends
  }
  const Eigen::Vector3d half = truth.shape.half_size;
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector3d p(half.x() * (-0.9 + 0.2 * (i % 10)), -half.y(),
                            half.z() * (-0.9 + 0.2 * (i / 10)));
    input.points.push_back({truth.T_map_object * p, desk.Pose(0).translation, 0.5});
  }
  PosedSuperquadric start = truth;
  const RefinementResult behind = RefineJointly(start, input, RefinementOptions());
  // Mirrored at the points: as good a fit to them, but in front.
  start.T_map_object.translation = truth.T_map_object * Eigen::Vector3d(0.0, -2.0 * half.y(), 0.0);
  const RefinementResult front = RefineJointly(start, input, RefinementOptions());
  EXPECT_LT(behind.cost, 0.7 * front.cost);
}

// Points on the front of a box as a camera that hardly moved gives them: all too near.
RefinementInput WithFrontTooNear(const SyntheticDesk& desk, const PosedSuperquadric& truth, double spread) {
  RefinementInput input = InputOf(desk, truth);
  input.assumption.support = 0.0;
  input.yaws = {{35.0 * M_PI / 180.0, 5.0 * M_PI / 180.0, 1.0}};
  const Eigen::Vector3d half = truth.shape.half_size;
  const Eigen::Vector3d outward = truth.T_map_object.rotation * Eigen::Vector3d(0.0, -1.0, 0.0);
  const Eigen::Vector3d centre = truth.T_map_object.translation;
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector3d p(half.x() * (-0.9 + 0.2 * (i % 10)), -half.y(),
                            half.z() * (-0.9 + 0.2 * (i / 10)));
    input.points.push_back(
        {truth.T_map_object * p + 0.2 * half.y() * outward, centre + 0.8 * outward, spread});
  }
  return input;
}

// One box around two objects says nothing about the points.
TEST(RefineJointly, TakesTheScaleOfItsSigmasFromMostBoxes) {
  const SyntheticDesk desk(1);
  const PosedSuperquadric truth = desk.Objects()[5].superquadric;
  RefinementInput input = InputOf(desk, truth);
  for (int i = 0; i < 60; ++i) {
    input.points.push_back({truth.T_map_object * truth.shape.PointAt(-1.2 + 0.04 * i, -3.0 + 0.1 * i),
                            desk.Pose(0).translation, kWideBaseline});
  }
  input.assumption.support = 0.0;
  const auto depth_sigma = [&] {
    return std::sqrt(RefineJointly(truth, input, RefinementOptions()).covariance(2, 2));
  };
  const double before = depth_sigma();
  Box2d& odd = input.views.front().box;
  odd = {odd.x - 2.0 * odd.width, odd.y - 2.0 * odd.height, 5.0 * odd.width, 5.0 * odd.height};
  EXPECT_NEAR(depth_sigma() / before, 1.0, 0.15);
}

// Points that alone show where the object is: its only box is cut off on all sides.
class PointWeight : public ::testing::Test {
 protected:
  PointWeight() {
    input_.views.resize(1);
    input_.views.front().edge_exact.fill(false);
  }

  RefinementResult Refine(std::size_t count, const RefinementOptions& options = {}) {
    input_.points.clear();
    for (std::size_t i = 0; i < count; ++i) {  // a spiral over the surface
      const double z = -0.95 + 1.9 * (static_cast<double>(i) + 0.5) / static_cast<double>(count);
      const Eigen::Vector3d p = truth_.shape.PointAt(std::asin(z), 2.4 * static_cast<double>(i));
      input_.points.push_back({truth_.T_map_object * p, truth_.T_map_object * (3.0 * p), kWideBaseline});
    }
    return RefineJointly(truth_, input_, options);
  }

  const SyntheticDesk desk_{1};
  const PosedSuperquadric truth_ = desk_.Objects()[5].superquadric;
  RefinementInput input_ = InputOf(desk_, truth_);
};

TEST_F(PointWeight, DoesNotJumpWithTheNumberOfPoints) {
  const auto sigma = [&](std::size_t count) {
    return std::sqrt(Refine(count).covariance.topLeftCorner<3, 3>().trace());
  };
  const double reference = sigma(75);
  for (const std::size_t count : {40, 76, 100, 150, 151, 400}) {
    EXPECT_NEAR(sigma(count) / reference, 1.0, 0.25) << count;
  }
}

TEST_F(PointWeight, ZeroLeavesOutThePoints) {
  RefinementOptions options;
  options.point_weight = 0.0;
  const RefinementResult with = Refine(50, options);
  const RefinementResult without = Refine(0, options);
  ASSERT_TRUE(std::isfinite(with.cost));
  EXPECT_NEAR(with.cost, without.cost, 0.5);
  EXPECT_LT((with.superquadric.shape.half_size - without.superquadric.shape.half_size).norm(),
            0.1 * truth_.shape.half_size.norm());
}

TEST(RefineJointly, WeighsPointsOfShortBaselinesLess) {
  const SyntheticDesk desk(1);
  const PosedSuperquadric truth = desk.Objects()[5].superquadric;
  RefinementOptions options;
  const auto overlap = [&](double spread) {
    return SolidIoU(RefineJointly(truth, WithFrontTooNear(desk, truth, spread), options).superquadric, truth);
  };
  const double hardly_moved = overlap(0.0);
  EXPECT_GT(hardly_moved, overlap(1.0) + 0.03);
  options.depth_sigma_px = 0.0;
  EXPECT_GT(hardly_moved, overlap(0.0) + 0.03);
}

TEST(RefineJointly, TakesUnseenExtentFromTheClass) {
  const SyntheticDesk desk(1);
  PosedSuperquadric truth = desk.Objects()[5].superquadric;
  truth.shape.half_size = {0.2, 0.015, 0.12};
  truth.T_map_object.translation.z() = 0.12;
  RefinementInput input = InputOf(desk, truth);
  input.yaws = {{35.0 * M_PI / 180.0, 5.0 * M_PI / 180.0, 1.0}};
  input.views.resize(3);  // hardly a change of direction
  PosedSuperquadric start = truth;
  start.shape.half_size.y() = 0.06;
  const auto thickness = [&](double ratio) {
    input.prior.log_width_ratio = std::log(ratio);
    input.prior.width_sigma = 0.3;
    return RefineJointly(start, input, RefinementOptions()).superquadric.shape.half_size.y();
  };
  EXPECT_LT(thickness(10.0), 0.6 * thickness(2.0));
}

TEST(RefineJointly, StaysAboveTheSurfaceBelow) {
  const SyntheticDesk desk(1);
  PosedSuperquadric truth = desk.Objects()[3].superquadric;
  const double lowest = truth.T_map_object.translation.z();  // as if its lower half were in the table
  RefinementInput input = InputOf(desk, truth);
  EXPECT_LT(Bottom(RefineJointly(truth, input, RefinementOptions()).superquadric), lowest - 0.05);
  input.assumption.lowest = lowest;
  EXPECT_GT(Bottom(RefineJointly(truth, input, RefinementOptions()).superquadric), lowest - 0.02);
}

TEST(RefineJointly, PutsTopAtTheHeightOfObjectsOnIt) {
  const SyntheticDesk desk(1);
  const PosedSuperquadric truth = desk.Objects()[3].superquadric;
  RefinementInput input = InputOf(desk, truth);
  for (SilhouetteView& view : input.views) {
    view.box.y -= 0.1 * view.box.height;  // a detector that boxes too much above
    view.box.height *= 1.1;
  }
  const auto top = [&] {
    const PosedSuperquadric s = RefineJointly(truth, input, RefinementOptions()).superquadric;
    return s.T_map_object.translation.z() + s.shape.half_size.z();
  };
  const double height = truth.T_map_object.translation.z() + truth.shape.half_size.z();
  const double off = top() - height;
  input.top_height = height;
  EXPECT_LT(std::abs(top() - height), 0.3 * off);
}

}  // namespace
}  // namespace sqslam
