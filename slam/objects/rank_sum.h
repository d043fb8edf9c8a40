#pragma once

#include <Eigen/Core>
#include <span>

namespace sqslam {

// Wilcoxon's rank-sum statistic of `a` within a and b together, standardised: (U - E[U]) / sigma[U], with
// middle ranks for ties and the variance corrected for them (Hollander, Wolfe and Chicken, Nonparametric
// Statistical Methods, chapter 4). About N(0, 1) where both come from one distribution; 0 where all values
// are equal or a sample is empty.
double RankSumZ(std::span<const double> a, std::span<const double> b);

// Whether two point clouds may be samples of one distribution: the rank-sum test accepts on each of the three
// axes at level alpha (Iqbal and Gans, IROS 2018; Wu et al., EAO-SLAM, IROS 2020). At most `max_points` of
// each cloud, evenly picked, are compared: the views of an object always differ a little, and with enough
// points any difference is significant. False for an empty cloud.
bool AreSameCloud(std::span<const Eigen::Vector3d> a, std::span<const Eigen::Vector3d> b, double alpha,
                  int max_points);

}  // namespace sqslam
