#include "slam/objects/rank_sum.h"

#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <utility>
#include <vector>

namespace sqslam {
namespace {

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
  std::sort(pooled.begin(), pooled.end());
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
