#include "slam/objects/metric_scale.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace sqslam {

double LogSize(const Superquadric& shape) { return (2.0 * shape.half_size).array().log().mean(); }

std::optional<MetricScale> ScaleFrom(const Landmark& landmark, const ClassTable& classes) {
  constexpr double kMinShare = 1e-3;  // of the information about the size that the class did not give
  const ObjectClass& known = classes.Of(landmark.labels.Best());
  const Eigen::Vector3d& half = landmark.superquadric.shape.half_size;
  const bool completed = half.head<2>() != landmark.visible.shape.half_size.head<2>();
  if (!known.log_metres || completed) {
    return std::nullopt;
  }
  const Eigen::Vector3d by_half = half.cwiseInverse() / 3.0;
  const double variance = by_half.dot(landmark.covariance.block<3, 3>(3, 3) * by_half);
  const double measured = 1.0 - variance / (known.size_sigma * known.size_sigma);
  return MetricScale{*known.log_metres - LogSize(landmark.superquadric.shape),
                     std::hypot(known.size_sigma, std::sqrt(variance / std::max(measured, kMinShare)))};
}

std::optional<MetricScale> CombinedScale(std::vector<MetricScale> estimates) {
  constexpr std::size_t kMinEstimates = 3;
  constexpr int kRounds = 10;
  if (estimates.size() < kMinEstimates) {
    return std::nullopt;
  }
  const auto middle = estimates.begin() + static_cast<std::ptrdiff_t>(estimates.size() / 2);
  std::ranges::nth_element(estimates, middle, {}, &MetricScale::log_scale);
  MetricScale scale{middle->log_scale, 0.0};
  for (int round = 0; round < kRounds; ++round) {
    double sum = 0.0;
    double weights = 0.0;
    for (const MetricScale& estimate : estimates) {
      const double residual = (estimate.log_scale - scale.log_scale) / estimate.sigma;
      const double weight = 1.0 / (estimate.sigma * estimate.sigma * (1.0 + residual * residual));
      sum += weight * estimate.log_scale;
      weights += weight;
    }
    scale = {sum / weights, 1.0 / std::sqrt(weights)};
  }
  return scale;
}

std::optional<MetricScale> ScaleOfMap(std::span<const Landmark* const> landmarks, const ClassTable& classes,
                                      const Landmark* excluded) {
  std::vector<MetricScale> estimates;
  for (const Landmark* landmark : landmarks) {
    if (const auto scale = landmark == excluded ? std::nullopt : ScaleFrom(*landmark, classes)) {
      estimates.push_back(*scale);
    }
  }
  return CombinedScale(std::move(estimates));
}

}  // namespace sqslam
