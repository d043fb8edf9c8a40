#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "refinement_scene.h"
#include "slam/objects/landmark_estimation.h"
#include "slam/objects/landmark_geometry.h"
#include "slam/objects/landmark_refinement.h"
#include "solid_overlap.h"

namespace sqslam {
namespace {

using testing::Bottom;
using testing::InputOf;
using testing::SolidIoU;
using testing::SyntheticDesk;

TEST(RefineStanding, PullsToTheSupportButNotFromFarAbove) {
  const SyntheticDesk desk(1);
  const SupportHeights supports{{0.0}, {}};
  PosedSuperquadric truth = desk.Objects()[3].superquadric;
  PosedSuperquadric start = truth;
  start.shape.half_size.z() *= 0.8;  // its lowest part was never seen
  const StandingFit standing = RefineStanding({&start, 1}, InputOf(desk, truth), supports,
                                              RefinementOptions(), SearchEffort::kPromising);
  EXPECT_EQ(standing.assumption.support, 0.0);
  EXPECT_NEAR(Bottom(standing.superquadric), 0.0, 0.005);
  truth = desk.Objects()[5].superquadric;
  truth.T_map_object.translation.z() += 0.3;  // on a shelf
  const StandingFit floating = RefineStanding({&truth, 1}, InputOf(desk, truth), supports,
                                              RefinementOptions(), SearchEffort::kPromising);
  EXPECT_EQ(floating.assumption.support, std::nullopt);
  EXPECT_NEAR(Bottom(floating.superquadric), 0.3, 0.01);
}

TEST(RefineStanding, FindsNearlyTheThoroughResultFromPromisingStarts) {
  const SyntheticDesk desk(1);
  const SupportHeights supports{{0.0, -0.2}, {}};
  for (const std::size_t index : {0U, 3U, 5U}) {
    const PosedSuperquadric truth = desk.Objects()[index].superquadric;
    RefinementInput input = InputOf(desk, truth);
    std::vector<PosedSuperquadric> starts;
    for (const double yaw : {0.0, 0.6}) {
      for (const auto& [e1, e2] : {std::pair(0.25, 0.25), std::pair(0.25, 1.0), std::pair(1.0, 1.0)}) {
        PosedSuperquadric start = truth;
        start.shape = {0.7 * truth.shape.half_size, e1, e2};
        start.T_map_object.rotation = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ());
        starts.push_back(start);
      }
    }
    const StandingFit thorough =
        RefineStanding(starts, input, supports, RefinementOptions(), SearchEffort::kThorough);
    const StandingFit promising =
        RefineStanding(starts, input, supports, RefinementOptions(), SearchEffort::kPromising);
    EXPECT_GT(SolidIoU(promising.superquadric, thorough.superquadric), 0.8) << index;
    EXPECT_LE(thorough.cost, promising.cost) << index;
  }
}

TEST(RefineStanding, FindsUnseenSurfaceWhenThorough) {
  const SyntheticDesk desk(1);
  const PosedSuperquadric truth = desk.Objects()[3].superquadric;
  const double in_the_way = 0.6 * truth.shape.half_size.z();  // the top of a book beside it
  const SupportHeights supports{{in_the_way}, {0.0}};
  const RefinementInput input = InputOf(desk, truth);
  const auto fit = [&](SearchEffort effort) {
    return RefineStanding({&truth, 1}, input, supports, RefinementOptions(), effort);
  };
  EXPECT_NE(fit(SearchEffort::kPromising).assumption.support, 0.0);
  EXPECT_EQ(fit(SearchEffort::kThorough).assumption.support, 0.0);
  EXPECT_GT(SolidIoU(fit(SearchEffort::kThorough).superquadric, truth),
            SolidIoU(fit(SearchEffort::kPromising).superquadric, truth) + 0.05);
}

// The floor is found all around an object on a table of which no point was found beside it.
TEST(RefineStanding, TriesTableOverTheFloorWithoutItsPoints) {
  const SyntheticDesk desk(1);
  const PosedSuperquadric truth = desk.Objects()[3].superquadric;
  const SupportHeights supports{{-0.7}, {0.0}};
  const StandingFit fit = RefineStanding({&truth, 1}, InputOf(desk, truth), supports, RefinementOptions(),
                                         SearchEffort::kPromising);
  EXPECT_EQ(fit.assumption.support, 0.0);
}

TEST(RefineStanding, LeavesWrongStartWhenThorough) {
  const SyntheticDesk desk(1);
  const SupportHeights supports{{0.0}, {}};
  PosedSuperquadric truth = desk.Objects()[5].superquadric;
  truth.shape = {{0.09, 0.03, 0.13}, 0.1, 0.1};
  truth.T_map_object.translation.z() = 0.13;
  RefinementInput input = InputOf(desk, truth);
  PosedSuperquadric start = truth;  // a ball within it
  start.shape = {{0.03, 0.03, 0.03}, 1.0, 1.0};
  const auto fit = [&](SearchEffort effort) {
    return RefineStanding({&start, 1}, input, supports, RefinementOptions(), effort);
  };
  EXPECT_LT(fit(SearchEffort::kThorough).cost, fit(SearchEffort::kPromising).cost - 5.0);
  EXPECT_GT(SolidIoU(fit(SearchEffort::kThorough).superquadric, truth), 0.9);
}

// Views of which the lower part is hidden; `shown`: the rest as share of the box.
RefinementInput HiddenBelow(const SyntheticDesk& desk, const PosedSuperquadric& truth, double shown) {
  RefinementInput input = InputOf(desk, truth);
  for (SilhouetteView& view : input.views) {
    view.box.height *= shown;
    view.edge_exact[kBottomEdge] = false;
  }
  return input;
}

TEST(RefineStanding, ExtendsHiddenLowerPartToTheSupport) {
  const SyntheticDesk desk(1);
  const PosedSuperquadric truth = desk.Objects()[5].superquadric;
  PosedSuperquadric upper = StretchedTo(truth, truth.T_map_object.translation.z());
  EXPECT_NEAR(Bottom(upper), truth.T_map_object.translation.z(), 1e-12);
  const RefinementInput input = HiddenBelow(desk, truth, 1.0);
  const SupportHeights supports{{0.0}, {}};
  const StandingFit fit =
      RefineStanding({&upper, 1}, input, supports, RefinementOptions(), SearchEffort::kPromising);
  EXPECT_EQ(fit.assumption.support, 0.0);
  EXPECT_GT(SolidIoU(fit.superquadric, truth), 0.7);
}

TEST(RefineStanding, ExceedsShownExtentOverAHiddenEnd) {
  const SyntheticDesk desk(1);
  PosedSuperquadric truth = desk.Objects()[5].superquadric;
  truth.shape.half_size.z() *= 6.0;
  truth.T_map_object.translation.z() = truth.shape.half_size.z();
  const RefinementInput input = HiddenBelow(desk, truth, 0.15);
  const PosedSuperquadric upper = StretchedTo(truth, 1.7 * truth.shape.half_size.z());
  const SupportHeights supports{{0.0}, {}};
  const StandingFit fit =
      RefineStanding({&upper, 1}, input, supports, RefinementOptions(), SearchEffort::kPromising);
  EXPECT_EQ(fit.assumption.support, 0.0);
  EXPECT_GT(SolidIoU(fit.superquadric, truth), 0.7);
}

// A tall object whose lower half stands behind a table as high as that.
struct BehindTable {
  explicit BehindTable(const SyntheticDesk& desk) : truth(desk.Objects()[5].superquadric) {
    truth.shape.half_size.z() *= 2.0;
    table = truth.T_map_object.translation.z() = truth.shape.half_size.z();
    input = HiddenBelow(desk, truth, 0.4);
  }

  std::optional<double> SupportAmong(const SupportHeights& supports) const {
    const PosedSuperquadric upper = StretchedTo(truth, 1.2 * table);
    return RefineStanding({&upper, 1}, input, supports, RefinementOptions(), SearchEffort::kPromising)
        .assumption.support;
  }

  PosedSuperquadric truth;
  double table = 0.0;
  RefinementInput input;
};

TEST(RefineStanding, ExtendsFloorClassesPastATable) {
  BehindTable object{SyntheticDesk(1)};
  const SupportHeights floor_unseen_nearby{{object.table}, {0.0}, 0.0};
  EXPECT_EQ(object.SupportAmong(floor_unseen_nearby), object.table);
  object.input.prior.on_floor = true;
  EXPECT_EQ(object.SupportAmong(floor_unseen_nearby), 0.0);
  EXPECT_EQ(object.SupportAmong({{object.table, 0.0}, {}, 0.0}), 0.0);
}

// The top of a stand without points of its own is known as well as the stand is.
TEST(RefineStanding, StandsOnTheTopOfAMappedObject) {
  BehindTable object{SyntheticDesk(1)};
  SupportHeights supports{{}, {}, 0.0};
  supports.near = {0.0};
  EXPECT_EQ(object.SupportAmong(supports), 0.0);
  supports.tops = {{object.table, 0.02}};
  EXPECT_EQ(object.SupportAmong(supports), object.table);
  EXPECT_EQ(supports.SigmaOf(object.table), 0.02);
  EXPECT_EQ(supports.SigmaOf(0.0), supports.sigma);
}

// Furniture hides the floor: the only surface that was found is the top of a table.
TEST(RefineStanding, DoesNotTakeTableForFloor) {
  BehindTable object{SyntheticDesk(1)};
  const Superquadric& shape = object.truth.shape;
  object.input.prior.on_floor = true;
  object.input.prior.log_height_ratio =
      std::log(shape.half_size.z() / std::sqrt(shape.half_size.x() * shape.half_size.y()));
  object.input.prior.height_sigma = 0.2;
  const PosedSuperquadric upper = StretchedTo(object.truth, 1.2 * object.table);
  const auto fit = [&](const SupportHeights& supports) {
    return RefineStanding({&upper, 1}, object.input, supports, RefinementOptions(), SearchEffort::kThorough);
  };
  EXPECT_EQ(fit({{object.table}, {}, object.table}).assumption.support, object.table);
  const StandingFit free = fit({{object.table}, {}, {}});
  EXPECT_EQ(free.assumption.support, std::nullopt);
  EXPECT_GT(SolidIoU(free.superquadric, object.truth), 0.7);
}

}  // namespace
}  // namespace sqslam
