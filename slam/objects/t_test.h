#pragma once

#include <Eigen/Core>

namespace sqslam {

// Running mean and variance of points, per axis (Welford).
struct PointStatistics {
  int count = 0;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Vector3d squares = Eigen::Vector3d::Zero();  // sums of squared differences from the mean

  void Add(const Eigen::Vector3d& p);
  void Merge(const PointStatistics& other);
  Eigen::Vector3d Variance() const;  // unbiased; zero for fewer than two points
};

// Critical value of |t|: t_{alpha/2, degrees}. Throws std::domain_error for degrees <= 0 or alpha outside (0,
// 1).
double CriticalT(double alpha, double degrees);

// One-sample t-test of section "Non inter-frame Association", all three axes: true where `p` is accepted as a
// further sample of the population. The paper's statistic compares a single centroid with the mean of n, so
// it rejects nearly everything once n is large (the critical value stays, sqrt(n) grows). `single` tests
// against the spread of single samples instead, sigma * sqrt(1 + 1/n). `min_sigma` keeps tiny spreads from
// rejecting all.
enum class OneSampleTest { kOfMean, kOfSingle };
bool IsSampleOf(const PointStatistics& population, const Eigen::Vector3d& p, double alpha, double min_sigma,
                OneSampleTest test = OneSampleTest::kOfMean);

// Two-sample t-test with pooled variance, all three axes: true where both are accepted as samples of one
// object.
bool AreSamePopulation(const PointStatistics& a, const PointStatistics& b, double alpha, double min_sigma);

}  // namespace sqslam
