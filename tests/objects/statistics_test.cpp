#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "slam/objects/statistical_tests.h"

namespace sqslam {
namespace {

PointStatistics StatisticsOf(const std::vector<Eigen::Vector3d>& points) {
  PointStatistics statistics;
  for (const Eigen::Vector3d& p : points) {
    statistics.Add(p);
  }
  return statistics;
}

// Sweat rate, sodium and potassium of 20 women: Johnson and Wichern, Applied Multivariate Statistical
// Analysis, table 5.1.
const std::vector<Eigen::Vector3d> kSweat = {
    {3.7, 48.5, 9.3},  {5.7, 65.1, 8.0},  {3.8, 47.2, 10.9}, {3.2, 53.2, 12.0}, {3.1, 55.5, 9.7},
    {4.6, 36.1, 7.9},  {2.4, 24.8, 14.0}, {7.2, 33.1, 7.6},  {6.7, 47.4, 8.5},  {5.4, 54.1, 11.3},
    {3.9, 36.9, 12.7}, {4.5, 58.8, 12.3}, {3.5, 27.8, 9.8},  {4.5, 40.2, 8.4},  {1.5, 13.5, 10.1},
    {8.5, 56.4, 7.1},  {4.5, 71.6, 8.2},  {6.5, 52.8, 10.9}, {4.1, 44.1, 11.2}, {5.5, 40.9, 9.4}};

TEST(Hotelling, AgreesWithTheTextbook) {
  const PointStatistics sweat = StatisticsOf(kSweat);
  EXPECT_TRUE(sweat.mean.isApprox(Eigen::Vector3d(4.640, 45.400, 9.965), 1e-3));
  Eigen::Matrix3d S;
  S << 2.879, 10.010, -1.810, 10.010, 199.788, -5.640, -1.810, -5.640, 3.628;
  EXPECT_TRUE(sweat.Covariance().isApprox(S, 1e-3));
  // 3 * 19 / 17 * F_{3, 17}(0.10), F = 2.44: the book's 8.18; T^2 for (4, 50, 10) is its 9.74.
  EXPECT_NEAR(CriticalHotelling(0.10, 19), 8.18, 0.01);
  const Eigen::Vector3d hypothesis(4.0, 50.0, 10.0);
  const auto accepts = [&](double alpha) {
    return IsSampleOf(sweat, hypothesis, alpha, 0.0, OneSampleTest::kOfMean, MeanTest::kHotelling);
  };
  EXPECT_FALSE(accepts(0.10));
  EXPECT_TRUE(accepts(0.05));
  // The level at which 9.74 is critical: F = 9.74 * 17 / 57 = 2.905 with 3 and 17 degrees, p = 0.0649.
  EXPECT_FALSE(accepts(0.0655));
  EXPECT_TRUE(accepts(0.0645));
}

TEST(Hotelling, TwoSamplesAreAcceptedUpToTheCriticalDistance) {
  // For two equal clouds shifted by d: T^2 = n / 2 * d^T S^-1 d.
  const PointStatistics a = StatisticsOf(kSweat);
  PointStatistics b = a;
  const Eigen::Vector3d direction(1.0, -3.0, 0.5);
  const double unit = direction.dot(a.Covariance().inverse() * direction);
  const double critical = std::sqrt(CriticalHotelling(0.01, 38) * 2.0 / 20.0 / unit);
  b.mean = a.mean + 0.999 * critical * direction;
  EXPECT_TRUE(AreSamePopulation(a, b, 0.01, 0.0, MeanTest::kHotelling));
  b.mean = a.mean + 1.001 * critical * direction;
  EXPECT_FALSE(AreSamePopulation(a, b, 0.01, 0.0, MeanTest::kHotelling));
}

// Points with correlated coordinates, mean 0.
class Correlated {
 public:
  explicit Correlated(unsigned seed) : generator_(seed) {
    L_ << 1.0, 0.0, 0.0, 0.8, 0.6, 0.0, -0.5, 0.3, 0.2;
  }
  Eigen::Vector3d Next() {
    const double x = gaussian_(generator_);
    const double y = gaussian_(generator_);
    const double z = gaussian_(generator_);
    return L_ * Eigen::Vector3d(x, y, z);
  }
  PointStatistics Sample(int count) {
    PointStatistics statistics;
    for (int i = 0; i < count; ++i) {
      statistics.Add(Next());
    }
    return statistics;
  }

 private:
  std::mt19937 generator_;
  std::normal_distribution<double> gaussian_;
  Eigen::Matrix3d L_;
};

// Share of true hypotheses that are rejected; its standard deviation at 4000 trials is 0.0034 for alpha 0.05.
TEST(Hotelling, RejectsTrueHypothesesAsOftenAsItSays) {
  constexpr int kTrials = 4000;
  constexpr double kAlpha = 0.05;
  Correlated source(11);
  int of_mean = 0;
  int of_single = 0;
  int of_two = 0;
  for (int i = 0; i < kTrials; ++i) {
    const PointStatistics a = source.Sample(8);
    const PointStatistics b = source.Sample(12);
    const Eigen::Vector3d p = source.Next();
    const auto test = MeanTest::kHotelling;
    of_mean += IsSampleOf(a, Eigen::Vector3d::Zero(), kAlpha, 0.0, OneSampleTest::kOfMean, test) ? 0 : 1;
    of_single += IsSampleOf(a, p, kAlpha, 0.0, OneSampleTest::kOfSingle, test) ? 0 : 1;
    of_two += AreSamePopulation(a, b, kAlpha, 0.0, test) ? 0 : 1;
  }
  EXPECT_NEAR(of_mean / double{kTrials}, kAlpha, 0.011);
  EXPECT_NEAR(of_single / double{kTrials}, kAlpha, 0.011);
  EXPECT_NEAR(of_two / double{kTrials}, kAlpha, 0.011);
}

TEST(TTest, RejectsTrueHypothesesAsOftenAsItSaysPerAxis) {
  constexpr int kTrials = 4000;
  constexpr double kAlpha = 0.05;
  std::mt19937 generator(5);
  std::normal_distribution<double> gaussian;
  const auto next = [&] {
    const double x = gaussian(generator);
    const double y = gaussian(generator);
    const double z = gaussian(generator);
    return Eigen::Vector3d(x, y, z);
  };
  int of_single = 0;
  int of_two = 0;
  for (int i = 0; i < kTrials; ++i) {
    PointStatistics a;
    PointStatistics b;
    for (int k = 0; k < 8; ++k) {
      a.Add(next());
      b.Add(next());
    }
    of_single += IsSampleOf(a, next(), kAlpha, 0.0, OneSampleTest::kOfSingle) ? 0 : 1;
    of_two += AreSamePopulation(a, b, kAlpha, 0.0) ? 0 : 1;
  }
  const double any_axis = 1.0 - std::pow(1.0 - kAlpha, 3);
  EXPECT_NEAR(of_single / double{kTrials}, any_axis, 0.02);
  EXPECT_NEAR(of_two / double{kTrials}, any_axis, 0.02);
}

TEST(PointStatistics, MovesExactlyWithTheMap) {
  Correlated source(3);
  const Sim3d move{
      2.5, Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, -1).normalized())), {3, -1, 2}};
  PointStatistics before;
  PointStatistics after;
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector3d p = source.Next();
    before.Add(p);
    after.Add(move * p);
  }
  before.Transform(move);
  EXPECT_TRUE(before.mean.isApprox(after.mean, 1e-12));
  EXPECT_TRUE(before.scatter.isApprox(after.scatter, 1e-12));
}

TEST(Hotelling, AnswersTheSameInEveryFrameWhereThePerAxisTestDoesNot) {
  Correlated source(4);
  const PointStatistics population = source.Sample(15);
  const Sim3d turn{
      1.0, Eigen::Quaterniond(Eigen::AngleAxisd(0.9, Eigen::Vector3d(1, -1, 2).normalized())), {0, 0, 0}};
  PointStatistics turned = population;
  turned.Transform(turn);
  int per_axis_differs = 0;
  for (int i = 0; i < 400; ++i) {
    const Eigen::Vector3d p = 1.7 * source.Next();
    const auto accepts = [&](const PointStatistics& s, const Eigen::Vector3d& q, MeanTest test) {
      return IsSampleOf(s, q, 0.05, 0.0, OneSampleTest::kOfSingle, test);
    };
    EXPECT_EQ(accepts(population, p, MeanTest::kHotelling), accepts(turned, turn * p, MeanTest::kHotelling));
    per_axis_differs +=
        accepts(population, p, MeanTest::kPerAxis) != accepts(turned, turn * p, MeanTest::kPerAxis) ? 1 : 0;
  }
  EXPECT_GT(per_axis_differs, 0);
}

TEST(Hotelling, SaysNoWhereThereAreTooFewToTell) {
  Correlated source(6);
  EXPECT_FALSE(IsSampleOf(source.Sample(3), Eigen::Vector3d::Zero(), 0.01, 1.0, OneSampleTest::kOfSingle,
                          MeanTest::kHotelling));
  EXPECT_TRUE(IsSampleOf(source.Sample(4), Eigen::Vector3d::Zero(), 0.01, 10.0, OneSampleTest::kOfSingle,
                         MeanTest::kHotelling));
  EXPECT_FALSE(AreSamePopulation(source.Sample(2), source.Sample(2), 0.01, 1.0, MeanTest::kHotelling));
}

TEST(RankSum, AgreesWithTheTextbook) {
  // Hollander and Wolfe, table 4.1 (permeability of the chorioamnion): rank sum of the five early values 30
  // of ranks 1 ... 15, mean 40, variance 5 * 10 * 16 / 12.
  const std::array<double, 10> term = {0.80, 0.83, 1.89, 1.04, 1.45, 1.38, 1.91, 1.64, 0.73, 1.46};
  const std::array<double, 5> early = {1.15, 0.88, 0.90, 0.74, 1.21};
  EXPECT_NEAR(RankSumZ(early, term), (30.0 - 40.0) / std::sqrt(50.0 * 16.0 / 12.0), 1e-12);
  EXPECT_NEAR(RankSumZ(term, early), -RankSumZ(early, term), 1e-12);
}

TEST(RankSum, TiesTakeTheirMiddleRank) {
  // Pooled 1 2 2 2 3: ranks 1, 3, 3, 3, 5; a = {1, 2} has rank sum 4, mean 6, variance 2 * 3 / 12 * (6 - 24 /
  // 20).
  const std::array<double, 2> a = {1.0, 2.0};
  const std::array<double, 3> b = {2.0, 2.0, 3.0};
  EXPECT_NEAR(RankSumZ(a, b), (4.0 - 6.0) / std::sqrt(0.5 * (6.0 - 24.0 / 20.0)), 1e-12);
  const std::array<double, 3> same = {1.0, 1.0, 1.0};
  EXPECT_EQ(RankSumZ(same, same), 0.0);
  EXPECT_EQ(RankSumZ(std::span<const double>(), same), 0.0);
}

TEST(RankSum, RejectsTrueHypothesesAsOftenAsItSaysAndSeesAShift) {
  constexpr int kTrials = 2000;
  std::mt19937 generator(8);
  std::exponential_distribution<double> skewed(1.0);
  int rejected = 0;
  int seen = 0;
  for (int i = 0; i < kTrials; ++i) {
    std::array<double, 25> a{};
    std::array<double, 40> b{};
    for (double& value : a) {
      value = skewed(generator);
    }
    for (double& value : b) {
      value = skewed(generator);
    }
    rejected += std::abs(RankSumZ(a, b)) > 1.96 ? 1 : 0;
    for (double& value : b) {
      value += 1.0;
    }
    seen += std::abs(RankSumZ(a, b)) > 1.96 ? 1 : 0;
  }
  EXPECT_NEAR(rejected / double{kTrials}, 0.05, 0.016);
  EXPECT_GT(seen, 0.9 * kTrials);
}

TEST(RankSum, TellsNeighbouringCloudsApartAndKnowsAHalfOfTheSame) {
  std::mt19937 generator(2);
  std::uniform_real_distribution<double> uniform(-0.05, 0.05);
  std::vector<Eigen::Vector3d> cup(200);
  for (Eigen::Vector3d& p : cup) {
    const double x = uniform(generator);
    const double y = uniform(generator);
    const double z = uniform(generator);
    p = {x, y, z};
  }
  const std::vector<Eigen::Vector3d> some(cup.begin(), cup.begin() + 40);
  std::vector<Eigen::Vector3d> next_one = some;
  for (Eigen::Vector3d& p : next_one) {
    p.y() += 0.05;
  }
  EXPECT_TRUE(AreSameCloud(some, cup, 0.01, 60));
  EXPECT_FALSE(AreSameCloud(next_one, cup, 0.01, 60));
  EXPECT_FALSE(AreSameCloud({}, cup, 0.01, 60));
}

}  // namespace
}  // namespace sqslam
