#include "slam/objects/t_test.h"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>

namespace sqslam {

void PointStatistics::Add(const Eigen::Vector3d& p) {
  ++count;
  const Eigen::Vector3d difference = p - mean;
  mean += difference / count;
  squares += difference.cwiseProduct(p - mean);
}

void PointStatistics::Merge(const PointStatistics& other) {
  if (other.count == 0) {
    return;
  }
  const double n = count;
  const double m = other.count;
  const Eigen::Vector3d difference = other.mean - mean;
  mean += difference * (m / (n + m));
  squares += other.squares + difference.cwiseAbs2() * (n * m / (n + m));
  count += other.count;
}

Eigen::Vector3d PointStatistics::Variance() const {
  return count < 2 ? Eigen::Vector3d::Zero() : Eigen::Vector3d(squares / (count - 1));
}

double CriticalT(double alpha, double degrees) {
  const boost::math::students_t_distribution<double> distribution(degrees);
  return boost::math::quantile(boost::math::complement(distribution, alpha / 2.0));
}

bool IsSampleOf(const PointStatistics& population, const Eigen::Vector3d& p, double alpha, double min_sigma,
                OneSampleTest test) {
  const int n = population.count;
  if (n < 2) {
    return false;
  }
  const double scale = test == OneSampleTest::kOfMean ? std::sqrt(1.0 / n) : std::sqrt(1.0 + 1.0 / n);
  const Eigen::Vector3d sigma = population.Variance().cwiseSqrt().cwiseMax(min_sigma);
  const Eigen::Vector3d t = (population.mean - p).cwiseAbs().cwiseQuotient(sigma) / scale;
  return t.maxCoeff() <= CriticalT(alpha, n - 1);
}

bool AreSamePopulation(const PointStatistics& a, const PointStatistics& b, double alpha, double min_sigma) {
  const int degrees = a.count + b.count - 2;
  if (a.count < 1 || b.count < 1 || degrees < 1) {
    return false;
  }
  const Eigen::Vector3d pooled = (((a.count - 1) * a.Variance() + (b.count - 1) * b.Variance()) / degrees)
                                     .cwiseSqrt()
                                     .cwiseMax(min_sigma);
  const Eigen::Vector3d t =
      (a.mean - b.mean).cwiseAbs().cwiseQuotient(pooled) / std::sqrt(1.0 / a.count + 1.0 / b.count);
  return t.maxCoeff() <= CriticalT(alpha, degrees);
}

}  // namespace sqslam
