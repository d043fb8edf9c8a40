#include "slam/objects/association.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>

#include "slam/objects/assignment.h"
#include "slam/objects/statistical_tests.h"
#include "slam/util/enum_names.h"

namespace sqslam {
namespace {

TEST(Assignment, FindsTheBestSumOfAllPermutations) {
  std::mt19937 generator(3);
  std::uniform_real_distribution<double> uniform(-0.3, 1.0);
  for (int trial = 0; trial < 50; ++trial) {
    Eigen::MatrixXd gain(4, 5);
    for (double& value : gain.reshaped()) {
      value = uniform(generator) - (trial % 2) * 0.5;  // half of them impossible in every other one
    }
    std::vector<int> columns(5);
    std::iota(columns.begin(), columns.end(), 0);
    double best = 0.0;
    do {
      double sum = 0.0;
      for (int row = 0; row < 4; ++row) {
        sum += std::max(0.0, gain(row, columns[row]));
      }
      best = std::max(best, sum);
    } while (std::next_permutation(columns.begin(), columns.end()));
    double found = 0.0;
    std::vector<int> used;
    const std::vector<int> result = AssignOptimally(gain);
    for (int row = 0; row < 4; ++row) {
      if (result[row] >= 0) {
        EXPECT_GT(gain(row, result[row]), 0.0);
        EXPECT_EQ(std::count(used.begin(), used.end(), result[row]), 0);
        used.push_back(result[row]);
        found += gain(row, result[row]);
      }
    }
    EXPECT_NEAR(found, best, 1e-12);
  }
}

TEST(Assignment, LeavesOutImpossiblePairs) {
  Eigen::MatrixXd gain(2, 1);
  gain << 0.0, 0.5;
  EXPECT_EQ(AssignOptimally(gain), (std::vector<int>{-1, 0}));
  EXPECT_TRUE(AssignOptimally(Eigen::MatrixXd(0, 3)).empty());
  EXPECT_EQ(AssignOptimally(Eigen::MatrixXd(2, 0)), (std::vector<int>{-1, -1}));
}

TEST(TTest, MatchesTabulatedCriticalValues) {
  EXPECT_NEAR(CriticalT(0.05, 30), 2.042, 5e-4);
  EXPECT_NEAR(CriticalT(0.001, 30), 3.646, 5e-4);
  EXPECT_NEAR(CriticalT(0.05, 1), 12.706, 5e-4);
}

PointStatistics Sample(const Eigen::Vector3d& mean, double sigma, int count, unsigned seed) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> gaussian(0.0, sigma);
  PointStatistics statistics;
  for (int i = 0; i < count; ++i) {
    const double x = gaussian(generator);
    const double y = gaussian(generator);
    const double z = gaussian(generator);
    statistics.Add(mean + Eigen::Vector3d(x, y, z));
  }
  return statistics;
}

TEST(TTest, MergesStatisticsExactly) {
  PointStatistics all;
  PointStatistics first;
  PointStatistics second;
  for (int i = 0; i < 9; ++i) {
    const Eigen::Vector3d p(i, i * i, 3.0 - i);
    all.Add(p);
    (i < 4 ? first : second).Add(p);
  }
  first.Merge(second);
  EXPECT_EQ(first.count, all.count);
  EXPECT_TRUE(first.mean.isApprox(all.mean));
  EXPECT_TRUE(first.scatter.isApprox(all.scatter));
}

TEST(TTest, AcceptsOwnSamplesAndRejectsDistantOnes) {
  const PointStatistics cup = Sample({1, 2, 3}, 0.02, 20, 1);
  EXPECT_TRUE(IsSampleOf(cup, {1.01, 2.0, 3.0}, 0.01, 0.0, OneSampleTest::kOfSingle));
  EXPECT_FALSE(IsSampleOf(cup, {1.2, 2.0, 3.0}, 0.01, 0.0, OneSampleTest::kOfSingle));
  EXPECT_FALSE(IsSampleOf(Sample({1, 2, 3}, 0.02, 1, 1), {1, 2, 3}, 0.01, 0.1));
  EXPECT_TRUE(AreSamePopulation(cup, Sample({1, 2, 3}, 0.02, 15, 2), 0.001, 0.0));
  EXPECT_FALSE(AreSamePopulation(cup, Sample({1.15, 2, 3}, 0.02, 15, 2), 0.001, 0.0));
}

KnownLandmark Cup(const std::optional<Box2d>& predicted = {},
                  const std::unordered_set<std::int64_t>& points = {}) {
  KnownLandmark landmark;
  landmark.labels.Add("cup", 1.0);
  landmark.predicted_box = predicted;
  landmark.point_ids = points;
  return landmark;
}

std::vector<int> AssociateAll(const std::vector<BoxCandidate>& boxes,
                              const std::vector<KnownLandmark>& landmarks,
                              const AssociationOptions& options) {
  std::vector<const KnownLandmark*> pointers;
  for (const KnownLandmark& landmark : landmarks) {
    pointers.push_back(&landmark);
  }
  return Associate(boxes, pointers, options);
}

BoxCandidate Candidate(const std::string& label, double score, const Box2d& box,
                       const std::vector<std::int64_t>& points = {},
                       const std::optional<Eigen::Vector3d>& centroid = {}) {
  BoxCandidate candidate;
  candidate.detection = {label, score, box};
  candidate.point_ids = points;
  candidate.centroid = centroid;
  return candidate;
}

TEST(Associate, SeparatesCupsInARowByTheirPoints) {
  const std::vector<KnownLandmark> known = {Cup(Box2d{100, 100, 40, 40}, {1, 2, 3, 4, 5, 6, 7, 8}),
                                            Cup(Box2d{112, 100, 40, 40}, {11, 12, 13, 14, 15, 16, 17, 18}),
                                            Cup(Box2d{124, 100, 40, 40}, {21, 22, 23, 24, 25, 26, 27, 28})};
  // The camera moved on by the cups' distance: overlap alone would take each for the next.
  const std::vector<BoxCandidate> boxes = {
      Candidate("cup", 0.9, {112, 100, 40, 40}, {1, 2, 3, 4, 5, 6, 7}),
      Candidate("cup", 0.9, {124, 100, 40, 40}, {11, 12, 13, 14, 15, 16, 17})};
  AssociationOptions options;
  EXPECT_EQ(AssociateAll(boxes, known, options), (std::vector<int>{0, 1}));
  options.method = AssociationMethod::kIou;
  EXPECT_EQ(AssociateAll(boxes, known, options), (std::vector<int>{1, 2}));
}

TEST(Associate, SurvivesWrongLabelAtTheSamePlace) {
  const std::vector<KnownLandmark> known = {Cup(Box2d{100, 100, 40, 40}, {1, 2, 3, 4, 5})};
  const BoxCandidate same = Candidate("bowl", 0.5, {101, 100, 40, 40}, {1, 2, 3, 4, 5});
  const BoxCandidate other = Candidate("bowl", 0.5, {125, 100, 40, 40}, {21, 22, 23, 24, 25});
  EXPECT_EQ(AssociateAll({same}, known, AssociationOptions()), std::vector<int>{0});
  EXPECT_EQ(AssociateAll({other}, known, AssociationOptions()), std::vector<int>{-1});
}

TEST(Associate, FindsObjectAfterAGapByTheTTest) {
  ObjectLandmarkView view;
  view.estimated = true;
  view.visible.shape.half_size.setConstant(0.05);
  view.visible.T_map_object.translation = {0, 0, 1};
  KnownLandmark landmark = Cup();
  landmark.centroids = Sample({0, 0, 1}, 0.02, 12, 5);
  landmark.projected_box = Box2d{100, 100, 40, 40};
  landmark.view = &view;
  const BoxCandidate back =
      Candidate("cup", 0.9, {110, 108, 40, 40}, {91, 92}, Eigen::Vector3d(0.01, 0.0, 1.01));
  BoxCandidate elsewhere = back;
  elsewhere.centroid = Eigen::Vector3d(0.3, 0.0, 1.0);
  AssociationOptions options;
  EXPECT_EQ(AssociateAll({back}, {landmark}, options), std::vector<int>{0});
  EXPECT_EQ(AssociateAll({elsewhere}, {landmark}, options), std::vector<int>{-1});
  options.method = AssociationMethod::kIouPoints;  // no t-test
  EXPECT_EQ(AssociateAll({back}, {landmark}, options), std::vector<int>{-1});
  options.method = AssociationMethod::kIouTTest;
  EXPECT_EQ(AssociateAll({back}, {landmark}, options), std::vector<int>{0});
}

TEST(Associate, PicksNearerOfTwoThatPassTheTest) {
  std::vector<KnownLandmark> known(2, Cup());
  known[0].centroids = Sample({0, 0, 1}, 0.03, 12, 5);
  known[1].centroids = Sample({0.06, 0, 1}, 0.03, 12, 6);
  AssociationOptions options;
  options.method = AssociationMethod::kIouTTest;
  const BoxCandidate near_right =
      Candidate("cup", 0.9, {0, 0, 40, 40}, {},
                Eigen::Vector3d(known[1].centroids.mean.array() + Eigen::Array3d(-0.01, 0, 0)));
  EXPECT_EQ(AssociateAll({near_right}, known, options), std::vector<int>{1});
  std::swap(known[0], known[1]);
  EXPECT_EQ(AssociateAll({near_right}, known, options), std::vector<int>{0});
}

std::vector<Eigen::Vector3d> CloudAt(const Eigen::Vector3d& centre, int count, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> uniform(-0.05, 0.05);
  std::vector<Eigen::Vector3d> cloud(count, centre);
  for (Eigen::Vector3d& p : cloud) {
    for (double& value : p.reshaped()) {
      value += uniform(generator);
    }
  }
  return cloud;
}

// The parts of every method, one situation each.
TEST(Associate, UsesOnlyTheTestsOfItsMethod) {
  const KnownLandmark next_frame = Cup(Box2d{100, 100, 40, 40});  // overlap only
  const KnownLandmark gap = Cup();
  const BoxCandidate by_box = Candidate("cup", 0.9, {102, 100, 40, 40});
  BoxCandidate by_points = by_box;
  by_points.point_ids = {1, 2, 3, 4, 5, 6, 7, 8};
  KnownLandmark with_points = gap;
  with_points.point_ids = {1, 2, 3, 4, 5, 6, 7, 8};
  BoxCandidate by_centroid = by_box;
  by_centroid.centroid = Eigen::Vector3d(0.005, 0, 1);
  KnownLandmark with_centroids = gap;
  with_centroids.centroids = Sample({0, 0, 1}, 0.01, 12, 5);
  BoxCandidate by_cloud = by_box;
  by_cloud.positions = CloudAt({0, 0, 1}, 30, 2);
  KnownLandmark with_cloud = gap;
  with_cloud.cloud = CloudAt({0, 0, 1}, 100, 1);
  KnownLandmark projected = gap;
  projected.projected_box = Box2d{100, 100, 40, 40};
  const auto finds = [](AssociationMethod method, const BoxCandidate& box, const KnownLandmark& landmark) {
    AssociationOptions options;
    options.method = method;
    return AssociateAll({box}, {landmark}, options) == std::vector<int>{0};
  };
  struct Expected {
    AssociationMethod method;
    bool box, points, centroid, cloud, projection;
  };
  const std::vector<Expected> table = {{AssociationMethod::kFull, true, true, true, false, true},
                                       {AssociationMethod::kIou, true, false, false, false, false},
                                       {AssociationMethod::kIouPoints, true, true, false, false, false},
                                       {AssociationMethod::kIouTTest, true, false, true, false, false},
                                       {AssociationMethod::kNonparametric, false, false, false, true, false},
                                       {AssociationMethod::kEnsemble, true, false, true, true, false}};
  for (const Expected& row : table) {
    EXPECT_EQ(finds(row.method, by_box, next_frame), row.box) << NameOf(row.method);
    EXPECT_EQ(finds(row.method, by_points, with_points), row.points) << NameOf(row.method);
    EXPECT_EQ(finds(row.method, by_centroid, with_centroids), row.centroid) << NameOf(row.method);
    EXPECT_EQ(finds(row.method, by_cloud, with_cloud), row.cloud) << NameOf(row.method);
    EXPECT_EQ(finds(row.method, by_box, projected), row.projection) << NameOf(row.method);
  }
  BoxCandidate elsewhere = by_cloud;
  elsewhere.positions = CloudAt({0, 0.06, 1}, 30, 3);
  EXPECT_FALSE(finds(AssociationMethod::kNonparametric, elsewhere, with_cloud));
}

}  // namespace
}  // namespace sqslam
