#include "slam/objects/association.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>

#include "slam/objects/assignment.h"
#include "slam/objects/t_test.h"
#include "slam/util/enum_names.h"

namespace sqslam {
namespace {

TEST(Assignment, FindsTheBestSumOfAllPermutations) {
  std::mt19937 generator(3);
  std::uniform_real_distribution<double> uniform(-0.3, 1.0);
  for (int trial = 0; trial < 50; ++trial) {
    Eigen::MatrixXd gain(4, 5);
    for (double& value : gain.reshaped()) {
      value = uniform(generator);
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

TEST(Assignment, LeavesOutWhatIsImpossible) {
  Eigen::MatrixXd gain(2, 1);
  gain << 0.0, 0.5;
  EXPECT_EQ(AssignOptimally(gain), (std::vector<int>{-1, 0}));
  EXPECT_TRUE(AssignOptimally(Eigen::MatrixXd(0, 3)).empty());
  EXPECT_EQ(AssignOptimally(Eigen::MatrixXd(2, 0)), (std::vector<int>{-1, -1}));
}

TEST(TTest, CriticalValuesAgreeWithTheTables) {
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

TEST(TTest, MergedStatisticsEqualThoseOfAllSamples) {
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

TEST(TTest, AcceptsItsOwnAndRejectsWhatIsFar) {
  const PointStatistics cup = Sample({1, 2, 3}, 0.02, 20, 1);
  EXPECT_TRUE(IsSampleOf(cup, {1.01, 2.0, 3.0}, 0.01, 0.0, OneSampleTest::kOfSingle));
  EXPECT_FALSE(IsSampleOf(cup, {1.2, 2.0, 3.0}, 0.01, 0.0, OneSampleTest::kOfSingle));
  EXPECT_FALSE(IsSampleOf(Sample({1, 2, 3}, 0.02, 1, 1), {1, 2, 3}, 0.01, 0.1));
  EXPECT_TRUE(AreSamePopulation(cup, Sample({1, 2, 3}, 0.02, 15, 2), 0.001, 0.0));
  EXPECT_FALSE(AreSamePopulation(cup, Sample({1.15, 2, 3}, 0.02, 15, 2), 0.001, 0.0));
}

KnownLandmark KnownAt(const std::string& label, const Box2d& box,
                      const std::unordered_set<std::int64_t>* points) {
  KnownLandmark landmark;
  landmark.label = label;
  landmark.frames_since_seen = 1;
  landmark.predicted_box = box;
  landmark.point_ids = points;
  return landmark;
}

TEST(Associate, TellsCupsInARowApartByTheirPoints) {
  const std::unordered_set<std::int64_t> left = {1, 2, 3, 4, 5, 6, 7, 8};
  const std::unordered_set<std::int64_t> right = {11, 12, 13, 14, 15, 16, 17, 18};
  const std::unordered_set<std::int64_t> third = {21, 22, 23, 24, 25, 26, 27, 28};
  const std::vector<KnownLandmark> known = {KnownAt("cup", {100, 100, 40, 40}, &left),
                                            KnownAt("cup", {112, 100, 40, 40}, &right),
                                            KnownAt("cup", {124, 100, 40, 40}, &third)};
  // The camera moved on by the cups' distance: overlap alone would take each for the next.
  const std::vector<MeasuredBox> boxes = {
      {{"cup", 0.9, {112, 100, 40, 40}}, {1, 2, 3, 4, 5, 6, 7}, {}, {}},
      {{"cup", 0.9, {124, 100, 40, 40}}, {11, 12, 13, 14, 15, 16, 17}, {}, {}}};
  AssociationOptions options;
  EXPECT_EQ(Associate(boxes, known, options), (std::vector<int>{0, 1}));
  options.method = AssociationMethod::kIou;
  EXPECT_EQ(Associate(boxes, known, options), (std::vector<int>{1, 2}));
}

TEST(Associate, SurvivesAWrongLabelAtTheSamePlace) {
  const std::unordered_set<std::int64_t> points = {1, 2, 3, 4, 5};
  const std::vector<KnownLandmark> known = {KnownAt("cup", {100, 100, 40, 40}, &points)};
  const MeasuredBox same{{"bowl", 0.5, {101, 100, 40, 40}}, {1, 2, 3, 4, 5}, {}, {}};
  const MeasuredBox other{{"bowl", 0.5, {125, 100, 40, 40}}, {21, 22, 23, 24, 25}, {}, {}};
  EXPECT_EQ(Associate({same}, known, AssociationOptions()), std::vector<int>{0});
  EXPECT_EQ(Associate({other}, known, AssociationOptions()), std::vector<int>{-1});
}

TEST(Associate, FindsAnObjectAgainAfterAGapByTheTTest) {
  const PointStatistics centroids = Sample({0, 0, 1}, 0.02, 12, 5);
  KnownLandmark landmark;
  landmark.label = "cup";
  landmark.frames_since_seen = 200;
  landmark.centroids = &centroids;
  landmark.projected_box = Box2d{100, 100, 40, 40};
  landmark.centre = Eigen::Vector3d(0, 0, 1);
  landmark.radius = 0.05;
  const MeasuredBox back{{"cup", 0.9, {110, 108, 40, 40}}, {91, 92}, Eigen::Vector3d(0.01, 0.0, 1.01), {}};
  MeasuredBox elsewhere = back;
  elsewhere.centroid = Eigen::Vector3d(0.3, 0.0, 1.0);
  AssociationOptions options;
  EXPECT_EQ(Associate({back}, {landmark}, options), std::vector<int>{0});
  EXPECT_EQ(Associate({elsewhere}, {landmark}, options), std::vector<int>{-1});
  options.method = AssociationMethod::kIouPoints;  // no t-test
  EXPECT_EQ(Associate({back}, {landmark}, options), std::vector<int>{-1});
  options.method = AssociationMethod::kIouTTest;
  EXPECT_EQ(Associate({back}, {landmark}, options), std::vector<int>{0});
  options.t_test = MeanTest::kHotelling;
  EXPECT_EQ(Associate({back}, {landmark}, options), std::vector<int>{0});
  EXPECT_EQ(Associate({elsewhere}, {landmark}, options), std::vector<int>{-1});
}

TEST(Associate, OfTwoThatPassTheTestTakesTheNearer) {
  const PointStatistics left = Sample({0, 0, 1}, 0.03, 12, 5);
  const PointStatistics right = Sample({0.06, 0, 1}, 0.03, 12, 6);
  std::vector<KnownLandmark> known(2);
  known[0].centroids = &left;
  known[1].centroids = &right;
  for (KnownLandmark& landmark : known) {
    landmark.label = "cup";
    landmark.frames_since_seen = 200;
  }
  AssociationOptions options;
  options.method = AssociationMethod::kIouTTest;
  const MeasuredBox near_right{
      {"cup", 0.9, {0, 0, 40, 40}}, {}, right.mean + Eigen::Vector3d(-0.01, 0, 0), {}};
  EXPECT_EQ(Associate({near_right}, known, options), std::vector<int>{1});
  std::swap(known[0], known[1]);
  EXPECT_EQ(Associate({near_right}, known, options), std::vector<int>{0});
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
TEST(Associate, EachMethodUsesItsOwnTestsAndNoOther) {
  const std::unordered_set<std::int64_t> points = {1, 2, 3, 4, 5, 6, 7, 8};
  const PointStatistics centroids = Sample({0, 0, 1}, 0.01, 12, 5);
  const std::vector<Eigen::Vector3d> cloud = CloudAt({0, 0, 1}, 100, 1);
  KnownLandmark next_frame;  // overlap only
  next_frame.label = "cup";
  next_frame.frames_since_seen = 1;
  next_frame.predicted_box = Box2d{100, 100, 40, 40};
  KnownLandmark gap = next_frame;
  gap.frames_since_seen = 200;
  gap.predicted_box.reset();
  const MeasuredBox by_box{{"cup", 0.9, {102, 100, 40, 40}}, {}, {}, {}};
  MeasuredBox by_points = by_box;
  by_points.point_ids = {1, 2, 3, 4, 5, 6, 7, 8};
  KnownLandmark with_points = gap;
  with_points.point_ids = &points;
  MeasuredBox by_centroid = by_box;
  by_centroid.centroid = Eigen::Vector3d(0.005, 0, 1);
  KnownLandmark with_centroids = gap;
  with_centroids.centroids = &centroids;
  MeasuredBox by_cloud = by_box;
  by_cloud.positions = CloudAt({0, 0, 1}, 30, 2);
  KnownLandmark with_cloud = gap;
  with_cloud.cloud = &cloud;
  KnownLandmark projected = gap;
  projected.projected_box = Box2d{100, 100, 40, 40};
  const auto finds = [](AssociationMethod method, const MeasuredBox& box, const KnownLandmark& landmark) {
    AssociationOptions options;
    options.method = method;
    return Associate({box}, {landmark}, options) == std::vector<int>{0};
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
  MeasuredBox elsewhere = by_cloud;
  elsewhere.positions = CloudAt({0, 0.06, 1}, 30, 3);
  EXPECT_FALSE(finds(AssociationMethod::kNonparametric, elsewhere, with_cloud));
}

}  // namespace
}  // namespace sqslam
