#pragma once

#include <Eigen/Core>
#include <span>

#include "slam/geometry/rigid3.h"

namespace sqslam {

// Running mean and scatter of points (Welford). Keeps the full scatter, because per-axis variances cannot be
// transformed into another frame.
struct PointStatistics {
  int count = 0;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();  // sum of d d^T, d: difference from the mean

  void Add(const Eigen::Vector3d& p);
  void Merge(const PointStatistics& other);
  // Applies p_new = S_new_old * p_old to every point.
  void Transform(const Sim3d& S_new_old);
  Eigen::Vector3d Variance() const;  // along each axis, unbiased; zero for fewer than two points

  static void VisitState(auto& self, auto&& visit) { visit(self.count, self.mean, self.scatter); }
};

// Critical value of |t|: t_{alpha/2, degrees}. Throws std::domain_error for degrees <= 0 or alpha outside (0,
// 1).
double CriticalT(double alpha, double degrees);

// One-sample t-test on each axis (section "Non inter-frame Association"): true if all three accept `p` as a
// further sample of the population; false if the population is too small to tell (n < 2). The paper's
// statistic compares a single centroid with the mean of n, so it rejects nearly everything for large n (the
// critical value stays, sqrt(n) grows). `kOfSingle` tests against the spread of single samples instead, sigma
// * sqrt(1 + 1/n). `min_sigma` (map units, in every direction) keeps tiny spreads from rejecting all.
enum class OneSampleTest { kOfMean, kOfSingle };
bool IsSampleOf(const PointStatistics& population, const Eigen::Vector3d& p, double alpha, double min_sigma,
                OneSampleTest scale = OneSampleTest::kOfMean);

// Two-sample test with pooled (co)variance: true if both are accepted as samples of one object; false if they
// are too small to tell (fewer than three points together).
bool AreSamePopulation(const PointStatistics& a, const PointStatistics& b, double alpha, double min_sigma);

// Wilcoxon's rank-sum statistic of `a` within a and b together, standardised: (U - E[U]) / sigma[U], with
// middle ranks for ties and the variance corrected for them (Hollander, Wolfe and Chicken, Nonparametric
// Statistical Methods, chapter 4). About N(0, 1) if both come from one distribution; 0 if all values are
// equal or a sample is empty.
double RankSumZ(std::span<const double> a, std::span<const double> b);

// True if two point clouds may be samples of one distribution: the rank-sum test accepts on each of the three
// axes at level alpha (Iqbal and Gans, IROS 2018; Wu et al., EAO-SLAM, IROS 2020). Compares at most
// `max_points` of each cloud, evenly picked: the views of an object always differ a little, and with enough
// points any difference is significant. False for an empty cloud.
bool AreSameCloud(std::span<const Eigen::Vector3d> a, std::span<const Eigen::Vector3d> b, double alpha,
                  int max_points);

}  // namespace sqslam
