#include "slam/objects/statistical_tests.h"

#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <utility>
#include <vector>

namespace sqslam {
namespace {

// Returns true if a difference of means, whose covariance is `scale` times one with variances `variance`
// (`degrees` degrees of freedom), is significant on no axis.
bool MayBeZero(const Eigen::Vector3d& difference, const Eigen::Vector3d& variance, double scale,
               double degrees, double alpha, double min_sigma) {
  const Eigen::Vector3d sigma = variance.cwiseSqrt().cwiseMax(min_sigma);
  const Eigen::Vector3d t = difference.cwiseAbs().cwiseQuotient(sigma) / std::sqrt(scale);
  return t.maxCoeff() <= CriticalT(alpha, degrees);
}

std::vector<double> EvenlyPicked(std::span<const Eigen::Vector3d> points, int axis, int max_points) {
  const std::size_t count = std::min(points.size(), static_cast<std::size_t>(max_points));
  std::vector<double> values;
  values.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    values.push_back(points[i * points.size() / count][axis]);
  }
  return values;
}

}  // namespace

void PointStatistics::Add(const Eigen::Vector3d& p) {
  ++count;
  const Eigen::Vector3d difference = p - mean;
  mean += difference / count;
  scatter += (1.0 - 1.0 / count) * difference * difference.transpose();
}

void PointStatistics::Merge(const PointStatistics& other) {
  if (other.count == 0) {
    return;
  }
  const double n = count;
  const double m = other.count;
  const Eigen::Vector3d difference = other.mean - mean;
  mean += difference * (m / (n + m));
  scatter += other.scatter + (n * m / (n + m)) * difference * difference.transpose();
  count += other.count;
}

void PointStatistics::Transform(const Sim3d& S_new_old) {
  const Eigen::Matrix3d sR = S_new_old.scale * S_new_old.rotation.toRotationMatrix();
  mean = S_new_old * mean;
  scatter = (sR * scatter * sR.transpose()).eval();
}

Eigen::Vector3d PointStatistics::Variance() const {
  return count < 2 ? Eigen::Vector3d::Zero() : Eigen::Vector3d(scatter.diagonal() / (count - 1));
}

double CriticalT(double alpha, double degrees) {
  const boost::math::students_t_distribution<double> distribution(degrees);
  return boost::math::quantile(boost::math::complement(distribution, alpha / 2.0));
}

bool IsSampleOf(const PointStatistics& population, const Eigen::Vector3d& p, double alpha, double min_sigma,
                OneSampleTest scale) {
  const int n = population.count;
  if (n < 2) {
    return false;
  }
  const double of_mean = 1.0 / n;
  return MayBeZero(population.mean - p, population.Variance(),
                   scale == OneSampleTest::kOfMean ? of_mean : 1.0 + of_mean, n - 1, alpha, min_sigma);
}

bool AreSamePopulation(const PointStatistics& a, const PointStatistics& b, double alpha, double min_sigma) {
  const int degrees = a.count + b.count - 2;
  if (a.count < 1 || b.count < 1 || degrees < 1) {
    return false;
  }
  const Eigen::Vector3d pooled = (a.scatter + b.scatter).diagonal() / degrees;
  return MayBeZero(a.mean - b.mean, pooled, 1.0 / a.count + 1.0 / b.count, degrees, alpha, min_sigma);
}

double RankSumZ(std::span<const double> a, std::span<const double> b) {
  const double n = static_cast<double>(a.size());
  const double m = static_cast<double>(b.size());
  std::vector<std::pair<double, bool>> pooled;  // value, of a
  pooled.reserve(a.size() + b.size());
  for (const double value : a) {
    pooled.emplace_back(value, true);
  }
  for (const double value : b) {
    pooled.emplace_back(value, false);
  }
  std::ranges::sort(pooled);
  double rank_sum = 0.0;
  double ties = 0.0;
  for (std::size_t begin = 0, end = 0; begin < pooled.size(); begin = end) {
    double of_a = 0.0;
    for (end = begin; end < pooled.size() && pooled[end].first == pooled[begin].first; ++end) {
      of_a += pooled[end].second ? 1.0 : 0.0;
    }
    const double t = static_cast<double>(end - begin);
    rank_sum += of_a * 0.5 * static_cast<double>(begin + 1 + end);
    ties += t * t * t - t;
  }
  const double N = n + m;
  const double variance = n * m / 12.0 * (N + 1.0 - ties / std::max(1.0, N * (N - 1.0)));
  return variance > 0.0 ? (rank_sum - 0.5 * n * (N + 1.0)) / std::sqrt(variance) : 0.0;
}

bool AreSameCloud(std::span<const Eigen::Vector3d> a, std::span<const Eigen::Vector3d> b, double alpha,
                  int max_points) {
  if (a.empty() || b.empty()) {
    return false;
  }
  const double critical =
      boost::math::quantile(boost::math::complement(boost::math::normal_distribution<double>(), alpha / 2.0));
  for (int axis = 0; axis < 3; ++axis) {
    const double z = RankSumZ(EvenlyPicked(a, axis, max_points), EvenlyPicked(b, axis, max_points));
    if (std::abs(z) > critical) {
      return false;
    }
  }
  return true;
}

}  // namespace sqslam
