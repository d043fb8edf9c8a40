#include "slam/objects/t_test.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>

namespace sqslam {
namespace {

constexpr int kDimensions = 3;

// Whether a difference of means, whose covariance is `scale` times `covariance` (with `degrees` degrees of
// freedom), may be chance.
bool MayBeZero(const Eigen::Vector3d& difference, const Eigen::Matrix3d& covariance, double scale,
               double degrees, double alpha, double min_sigma, MeanTest test) {
  if (test == MeanTest::kPerAxis) {
    const Eigen::Vector3d sigma = covariance.diagonal().cwiseSqrt().cwiseMax(min_sigma);
    const Eigen::Vector3d t = difference.cwiseAbs().cwiseQuotient(sigma) / std::sqrt(scale);
    return t.maxCoeff() <= CriticalT(alpha, degrees);
  }
  if (degrees < kDimensions) {
    return false;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(covariance);
  const Eigen::Vector3d variances = axes.eigenvalues().cwiseMax(min_sigma * min_sigma);
  const Eigen::Vector3d along = axes.eigenvectors().transpose() * difference;
  return along.cwiseAbs2().cwiseQuotient(variances).sum() / scale <= CriticalHotelling(alpha, degrees);
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

Eigen::Matrix3d PointStatistics::Covariance() const {
  return count < 2 ? Eigen::Matrix3d::Zero() : Eigen::Matrix3d(scatter / (count - 1));
}

Eigen::Vector3d PointStatistics::Variance() const { return Covariance().diagonal(); }

double CriticalT(double alpha, double degrees) {
  const boost::math::students_t_distribution<double> distribution(degrees);
  return boost::math::quantile(boost::math::complement(distribution, alpha / 2.0));
}

double CriticalHotelling(double alpha, double degrees) {
  const double rest = degrees - kDimensions + 1.0;
  const boost::math::fisher_f_distribution<double> distribution(kDimensions, rest);
  return kDimensions * degrees / rest * boost::math::quantile(boost::math::complement(distribution, alpha));
}

bool IsSampleOf(const PointStatistics& population, const Eigen::Vector3d& p, double alpha, double min_sigma,
                OneSampleTest scale, MeanTest test) {
  const int n = population.count;
  if (n < 2) {
    return false;
  }
  const double of_mean = 1.0 / n;
  return MayBeZero(population.mean - p, population.Covariance(),
                   scale == OneSampleTest::kOfMean ? of_mean : 1.0 + of_mean, n - 1, alpha, min_sigma, test);
}

bool AreSamePopulation(const PointStatistics& a, const PointStatistics& b, double alpha, double min_sigma,
                       MeanTest test) {
  const int degrees = a.count + b.count - 2;
  if (a.count < 1 || b.count < 1 || degrees < 1) {
    return false;
  }
  const Eigen::Matrix3d pooled = (a.scatter + b.scatter) / degrees;
  return MayBeZero(a.mean - b.mean, pooled, 1.0 / a.count + 1.0 / b.count, degrees, alpha, min_sigma, test);
}

}  // namespace sqslam
