#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "slam/objects/detection_filter.h"
#include "slam/objects/isolation_forest.h"
#include "slam/objects/landmark_outliers.h"
#include "test_camera.h"

namespace sqslam {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;

TEST(IsolationForest, NormalisesByTheClosedForm) {
  EXPECT_EQ(MeanIsolationDepth(0), 0.0);
  EXPECT_EQ(MeanIsolationDepth(1), 0.0);
  EXPECT_DOUBLE_EQ(MeanIsolationDepth(2), 1.0);
  EXPECT_NEAR(MeanIsolationDepth(3), 2.0 * 1.5 - 4.0 / 3.0, 1e-15);
  // 2 H(n - 1) - 2 (n - 1) / n with H(m) ~ ln m + gamma + 1 / (2 m).
  EXPECT_NEAR(MeanIsolationDepth(256), 2.0 * (std::log(255.0) + 0.5772156649 + 1.0 / 510.0) - 510.0 / 256.0,
              1e-5);
}

std::vector<Eigen::Vector3d> Cloud(int count, unsigned seed) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> gaussian(0.0, 0.05);
  std::vector<Eigen::Vector3d> points(count);
  for (Eigen::Vector3d& p : points) {
    p = {gaussian(generator), gaussian(generator), gaussian(generator)};
  }
  return points;
}

// For each point whether its score lets it stay; all of them where there are no scores.
std::vector<bool> Kept(const std::vector<Eigen::Vector3d>& points, const IsolationForestOptions& options,
                       std::uint64_t seed) {
  const std::vector<double> scores = AnomalyScores(points, options, seed);
  std::vector<bool> keep(points.size(), true);
  std::transform(scores.begin(), scores.end(), keep.begin(),
                 [&](double score) { return score <= options.threshold; });
  return keep;
}

TEST(IsolationForest, RemovesPlantedOutliersAndKeepsTheCloud) {
  std::vector<Eigen::Vector3d> points = Cloud(200, 1);
  const std::vector<Eigen::Vector3d> planted = {{0.6, 0, 0}, {0, -0.7, 0.1}, {0.4, 0.4, 0.4}, {0, 0, 0.8}};
  points.insert(points.end(), planted.begin(), planted.end());
  const std::vector<bool> keep = Kept(points, IsolationForestOptions(), 7);
  EXPECT_EQ(std::count(keep.end() - 4, keep.end(), true), 0);
  EXPECT_GE(std::count(keep.begin(), keep.end() - 4, true), 190);
}

TEST(IsolationForest, ScoresGrowWithDistance) {
  const std::vector<Eigen::Vector3d> points = Cloud(300, 2);
  const IsolationForest forest(points, IsolationForestOptions(), 3);
  const double middle = forest.Score(Eigen::Vector3d::Zero());
  const double rim = forest.Score({0.15, 0, 0});
  const double far = forest.Score({1.0, 0, 0});
  EXPECT_LT(middle, 0.5);
  EXPECT_LT(middle, rim);
  EXPECT_LT(rim, far);
  EXPECT_LT(far, 1.0);
}

TEST(IsolationForest, DependsOnlyOnTheSeed) {
  const std::vector<Eigen::Vector3d> points = Cloud(100, 2);
  const IsolationForest a(points, IsolationForestOptions(), 3);
  const IsolationForest b(points, IsolationForestOptions(), 3);
  const IsolationForest c(points, IsolationForestOptions(), 4);
  EXPECT_EQ(a.Score(points[0]), b.Score(points[0]));
  EXPECT_NE(a.Score(points[0]), c.Score(points[0]));
}

// In a cloud stretched along a diagonal, planes at random angles see what axis-parallel ones can't: a point
// in the empty corner of the cloud's bounding box stands out.
TEST(IsolationForest, DrawsPlanesAtAllAngles) {
  std::vector<Eigen::Vector3d> points = Cloud(300, 5);
  for (Eigen::Vector3d& p : points) {
    p = Eigen::Vector3d(p.x() + 0.1 * p.y(), p.x() - 0.1 * p.y(), 0.1 * p.z());
  }
  const IsolationForest forest(points, IsolationForestOptions(), 3);
  EXPECT_GT(forest.Score({0.05, -0.05, 0.0}), forest.Score({0.05, 0.05, 0.0}) + 0.05);
  // And nothing depends on how the cloud lies, on average over trees.
  IsolationForestOptions many;
  many.trees = 1000;
  const Eigen::Matrix3d R = Eigen::AngleAxisd(0.6, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  std::vector<Eigen::Vector3d> turned = points;
  for (Eigen::Vector3d& p : turned) {
    p = R * p;
  }
  const IsolationForest straight_forest(points, many, 4);
  const IsolationForest turned_forest(turned, many, 4);
  for (const Eigen::Vector3d& p : {Eigen::Vector3d(0.05, 0.05, 0.0), Eigen::Vector3d(0.05, -0.05, 0.0)}) {
    EXPECT_NEAR(straight_forest.Score(p), turned_forest.Score(R * p), 0.02);
  }
}

TEST(IsolationForest, CanBeSwitchedOff) {
  std::vector<Eigen::Vector3d> points = Cloud(200, 1);
  points.emplace_back(5.0, 0.0, 0.0);
  IsolationForestOptions options;
  EXPECT_FALSE(Kept(points, options, 7).back());
  options.enabled = false;
  EXPECT_TRUE(Kept(points, options, 7).back());
}

TEST(IsolationForest, LeavesSmallAndDegenerateCloudsAlone) {
  const std::vector<Eigen::Vector3d> few = Cloud(10, 1);
  const std::vector<bool> all(10, true);
  EXPECT_EQ(Kept(few, IsolationForestOptions(), 1), all);
  const std::vector<Eigen::Vector3d> same(50, Eigen::Vector3d::Ones());
  const std::vector<bool> keep = Kept(same, IsolationForestOptions(), 1);
  EXPECT_EQ(std::count(keep.begin(), keep.end(), true), 50);
}

TEST(DepthGate, DropsTheBackground) {
  const std::vector<double> depths = {1.0, 1.02, 1.05, 0.98, 1.01, 1.03, 3.0};
  const std::vector<bool> keep = GateDepths(depths, 1.5);
  EXPECT_EQ(std::count(keep.begin(), keep.end(), true), 6);
  EXPECT_FALSE(keep.back());
  EXPECT_EQ(GateDepths({1.0, 9.0, 2.0}, 1.5), std::vector<bool>(3, true));
}

TEST(DepthGate, CanBeSwitchedOff) {
  EXPECT_EQ(GateDepths({1.0, 1.02, 1.05, 0.98, 1.01, 1.03, 3.0}, 0.0), std::vector<bool>(7, true));
}

ObjectFrame FrameWith(const std::vector<Detection>& detections) {
  ObjectFrame frame;
  frame.camera = {640, 480, 500, 500, 320, 240, {}, 30};
  frame.detections = detections;
  return frame;
}

// Points of a chair below the edge of a table that hides it in most views.
TEST(RemoveOutliers, KeepsPointsBeyondAHiddenEdge) {
  ObjectOptions options;
  options.outliers.isolation_forest.enabled = false;
  const SupportSurfaces surfaces;
  const PointLookup lookup = [](std::int64_t& id) -> std::optional<Eigen::Vector3d> {
    return Eigen::Vector3d(0.0, 0.05 * static_cast<double>(id), 2.0);
  };
  EstimationContext context;
  context.options = &options;
  context.points = &lookup;
  context.camera = testing::TestCamera();
  context.supports = &surfaces;
  const auto count_kept = [&](bool lower_edge_is_free) {
    Landmark landmark;
    for (std::int64_t id = 0; id < 10; ++id) {
      landmark.votes[id].inside = 5;
    }
    for (int i = 0; i < 10; ++i) {
      BoxView view;
      view.box = {300.0, 220.0, 40.0, i < 2 ? 200.0 : 60.0};
      view.edge_free = {true, true, true, i < 2 || lower_edge_is_free};
      landmark.views.push_back(view);
    }
    return RemoveOutliers(landmark, landmark.views, context).size();
  };
  EXPECT_EQ(count_kept(false), 10u);
  EXPECT_LT(count_kept(true), 6u);
}

// A dense cloud, a point far off it that all boxes hold, one beside the boxes and one that was seen but once.
TEST(RemoveOutliers, ReportsVerdictOfEveryPoint) {
  constexpr std::int64_t kFarOff = 200;
  constexpr std::int64_t kBeside = 201;
  constexpr std::int64_t kSeenOnce = 202;
  std::vector<Eigen::Vector3d> points = Cloud(203, 1);
  points[kFarOff] = {0.0, 0.0, 1.5};
  points[kBeside] = {0.8, 0.0, 0.0};
  const PointLookup lookup = [&](std::int64_t& id) -> std::optional<Eigen::Vector3d> {
    return Eigen::Vector3d(points[static_cast<std::size_t>(id)] + Eigen::Vector3d(0.0, 0.0, 3.0));
  };
  const ObjectOptions options;
  const SupportSurfaces surfaces;
  EstimationContext context;
  context.options = &options;
  context.points = &lookup;
  context.camera = testing::TestCamera();
  context.supports = &surfaces;
  Landmark landmark;
  for (std::int64_t id = 0; id < 203; ++id) {
    landmark.votes[id].inside = id == kSeenOnce ? 1 : 8;
  }
  BoxView view;
  view.box = {270.0, 190.0, 100.0, 100.0};
  view.edge_free = {true, true, true, true};
  landmark.views.assign(8, view);
  const NamedPoints kept = RemoveOutliers(landmark, landmark.views, context);
  ASSERT_EQ(landmark.verdicts.size(), 203u);
  NamedPoints said;
  for (const PointVerdict& verdict : landmark.verdicts) {
    if (verdict.kept) {
      std::int64_t id = verdict.point;
      said.emplace_back(id, *lookup(id));
      EXPECT_GT(verdict.anomaly, 0.2);
      EXPECT_LE(verdict.anomaly, options.outliers.isolation_forest.threshold);
    }
  }
  EXPECT_EQ(said, kept);
  EXPECT_FALSE(landmark.verdicts[kFarOff].kept);
  EXPECT_GT(landmark.verdicts[kFarOff].anomaly, options.outliers.isolation_forest.threshold);
  EXPECT_EQ(landmark.verdicts[kFarOff].sightings, 8);
  for (const std::int64_t id : {kBeside, kSeenOnce}) {
    EXPECT_FALSE(landmark.verdicts[static_cast<std::size_t>(id)].kept);
    EXPECT_EQ(landmark.verdicts[static_cast<std::size_t>(id)].anomaly, 0.0) << "the forest never saw it";
  }
}

TEST(SelectBoxes, DropsIgnoredLabelsDuplicatesAndHugeBoxes) {
  const ObjectFrame frame = FrameWith({{"cup", 0.6, {100, 100, 40, 40}},
                                       {"bowl", 0.8, {102, 101, 40, 40}},
                                       {"person", 0.9, {50, 200, 300, 100}},
                                       {"tv", 0.9, {2, 2, 630, 470}},
                                       {"book", 0.1, {300, 300, 50, 50}},
                                       {"book", 0.5, {400, 300, 50, 50}}});
  const std::vector<BoxCandidate> boxes = SelectBoxes(frame, DetectionFilterOptions(), 1.5);
  ASSERT_EQ(boxes.size(), 2u);
  EXPECT_EQ(boxes[0].detection_index, 1);
  EXPECT_EQ(boxes[1].detection_index, 5);
}

TEST(SelectBoxes, MarksEdgesThatTheImageOrAnotherObjectCuts) {
  ObjectFrame frame = FrameWith({{"tv", 0.9, {0, 100, 200, 200}}, {"cup", 0.9, {120, 220, 110, 130}}});
  for (int i = 0; i < 5; ++i) {
    const double x = 20.0 + 20.0 * i;
    frame.points.push_back({i, {x, 150}, {0.01 * i, 0, 2.0}});
    frame.points.push_back({10 + i, {190.0 + i, 320}, {0.01 * i, 0, 1.0}});
  }
  const std::vector<BoxCandidate> boxes = SelectBoxes(frame, DetectionFilterOptions(), 1.5);
  ASSERT_EQ(boxes.size(), 2u);
  // The cup is nearer and stands before the screen's lower right corner.
  EXPECT_THAT(boxes[0].edges.cut, ElementsAre(true, false, false, false));
  EXPECT_THAT(boxes[0].edges.hidden, ElementsAre(false, false, true, true));
  EXPECT_THAT(boxes[1].edges.Free(), Each(true));
  EXPECT_EQ(boxes[0].point_ids.size(), 5u);
  ASSERT_TRUE(boxes[1].centroid.has_value());
  EXPECT_NEAR(boxes[1].centroid->z(), 1.0, 1e-12);
}

// The far corner of a microwave behind a cereal box whose front is farther away than the microwave's.
TEST(SelectBoxes, LetsBoxesOverTheSameDepthsHideEachOther) {
  const auto with_depths = [](double nearest_of_left, double farthest_of_left) {
    ObjectFrame frame =
        FrameWith({{"microwave", 0.9, {100, 200, 120, 150}}, {"cereal_box", 0.9, {200, 150, 100, 180}}});
    for (int i = 0; i < 9; ++i) {
      const double depth = nearest_of_left + (farthest_of_left - nearest_of_left) * i / 8.0;
      frame.points.push_back({i, {110.0 + 5.0 * i, 250}, {0.01 * i, 0, depth}});
      frame.points.push_back({20 + i, {230.0 + 5.0 * i, 200}, {0.01 * i, 0, 1.0 + 0.01 * i}});
    }
    return SelectBoxes(frame, DetectionFilterOptions(), 1.5);
  };
  std::vector<BoxCandidate> boxes = with_depths(0.8, 1.26);
  ASSERT_EQ(boxes.size(), 2u);
  ASSERT_LT(boxes[0].median_depth, boxes[1].median_depth);
  EXPECT_THAT(boxes[0].edges.hidden, ElementsAre(false, false, true, false));
  EXPECT_THAT(boxes[1].edges.hidden, ElementsAre(true, false, false, false));
  boxes = with_depths(0.7, 0.9);
  EXPECT_THAT(boxes[0].edges.Free(), Each(true)) << "all of it is nearer";
}

// Detectors end the box of a large thing short of the border that cuts it.
TEST(SelectBoxes, WidensBorderMarginWithTheBox) {
  const ObjectFrame frame = FrameWith({{"chair", 0.9, {12, 100, 300, 200}},
                                       {"cup", 0.9, {12, 400, 40, 40}},
                                       {"couch", 0.9, {330, 220, 200, 250}}});
  const std::vector<BoxCandidate> boxes = SelectBoxes(frame, DetectionFilterOptions(), 1.5);
  ASSERT_EQ(boxes.size(), 3u);
  EXPECT_THAT(boxes[0].edges.cut, ElementsAre(true, false, false, false));
  EXPECT_THAT(boxes[1].edges.Free(), Each(true));
  EXPECT_THAT(boxes[2].edges.cut, ElementsAre(false, false, false, true));
}

// A table's box holds the boxes of what stands on it and may be nearer by its median depth.
TEST(SelectBoxes, HidesNothingThatStandsOnATable) {
  ObjectFrame frame =
      FrameWith({{"cup", 0.9, {200, 200, 50, 50}}, {"dining_table", 0.9, {100, 150, 400, 300}}});
  for (int i = 0; i < 5; ++i) {
    frame.points.push_back({i, {205.0 + 5.0 * i, 220}, {0.01 * i, 0, 2.0}});
    frame.points.push_back({10 + i, {150.0 + 5.0 * i, 420}, {0.01 * i, 0, 1.0}});
    frame.points.push_back({20 + i, {250.0 + 5.0 * i, 420}, {0.01 * i, 0, 1.0}});
  }
  const std::vector<BoxCandidate> boxes = SelectBoxes(frame, DetectionFilterOptions(), 1.5);
  ASSERT_EQ(boxes.size(), 2u);
  ASSERT_LT(boxes[1].median_depth, boxes[0].median_depth);
  EXPECT_THAT(boxes[0].edges.Free(), Each(true));
}

// Points that come and go must not pile up until the object is estimated again.
TEST(Votes, DropVotesOfGonePointsWhenThereAreMany) {
  Landmark landmark;
  for (std::int64_t point = 0; point < 900; ++point) {
    landmark.votes[point].inside = 2;
  }
  const PointLookup few_stay = [](std::int64_t& id) -> std::optional<Eigen::Vector3d> {
    id = id == 1 ? 0 : id;  // it was fused
    return id < 50 ? std::optional(Eigen::Vector3d(1.0, 2.0, 3.0)) : std::nullopt;
  };
  ForgetGonePoints(landmark, few_stay);
  EXPECT_EQ(landmark.votes.size(), 900U) << "few: left to the next estimation";
  for (std::int64_t point = 900; point < 5000; ++point) {
    landmark.votes[point].inside = 2;
  }
  ForgetGonePoints(landmark, few_stay);
  EXPECT_EQ(landmark.votes.size(), 49U);
  EXPECT_EQ(landmark.votes.at(0).inside, 4);
}

}  // namespace
}  // namespace sqslam
