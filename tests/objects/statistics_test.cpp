#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "slam/objects/statistical_tests.h"

namespace sqslam {
namespace {

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

 private:
  std::mt19937 generator_;
  std::normal_distribution<double> gaussian_;
  Eigen::Matrix3d L_;
};

TEST(TTest, RejectsWhenTooFewSamples) {
  PointStatistics one;
  one.Add({0, 0, 1});
  EXPECT_FALSE(IsSampleOf(one, {0, 0, 1}, 0.01, 1.0));
  EXPECT_FALSE(AreSamePopulation(one, PointStatistics(), 0.01, 1.0));
}

// The standard deviation of these shares at 4000 trials is 0.0055.
TEST(TTest, RejectsTrueHypothesesAtItsLevelPerAxis) {
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

TEST(RankSum, MatchesTheTextbook) {
  // Hollander and Wolfe, table 4.1 (permeability of the chorioamnion): rank sum of the five early values 30
  // of ranks 1 ... 15, mean 40, variance 5 * 10 * 16 / 12.
  const std::array<double, 10> term = {0.80, 0.83, 1.89, 1.04, 1.45, 1.38, 1.91, 1.64, 0.73, 1.46};
  const std::array<double, 5> early = {1.15, 0.88, 0.90, 0.74, 1.21};
  EXPECT_NEAR(RankSumZ(early, term), (30.0 - 40.0) / std::sqrt(50.0 * 16.0 / 12.0), 1e-12);
  EXPECT_NEAR(RankSumZ(term, early), -RankSumZ(early, term), 1e-12);
}

TEST(RankSum, GivesTiesTheirMiddleRank) {
  // Pooled 1 2 2 2 3: ranks 1, 3, 3, 3, 5; a = {1, 2} has rank sum 4, mean 6, variance 2 * 3 / 12 * (6 - 24 /
  // 20).
  const std::array<double, 2> a = {1.0, 2.0};
  const std::array<double, 3> b = {2.0, 2.0, 3.0};
  EXPECT_NEAR(RankSumZ(a, b), (4.0 - 6.0) / std::sqrt(0.5 * (6.0 - 24.0 / 20.0)), 1e-12);
  const std::array<double, 3> same = {1.0, 1.0, 1.0};
  EXPECT_EQ(RankSumZ(same, same), 0.0);
  EXPECT_EQ(RankSumZ(std::span<const double>(), same), 0.0);
}

TEST(RankSum, RejectsTrueHypothesesAtItsLevelAndDetectsShift) {
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

TEST(RankSum, SeparatesNeighboursAndRecognisesHalfOfTheSameCloud) {
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
