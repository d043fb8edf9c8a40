#include "slam/objects/reliability.h"

#include <algorithm>
#include <cmath>

namespace sqslam {

double ClassSurprise(const Superquadric& shape, const ObjectClass& prior,
                     const std::optional<MetricScale>& scale) {
  const Eigen::Vector3d logs = (2.0 * shape.half_size).array().log().matrix();
  const auto square = [](double value) { return value * value; };
  double sum = square((std::abs(logs.x() - logs.y()) - prior.log_width_ratio) / prior.width_sigma) +
               square((logs.z() - 0.5 * (logs.x() + logs.y()) - prior.log_height_ratio) / prior.height_sigma);
  if (scale && prior.log_metres) {
    sum += square((logs.mean() + scale->log_scale - *prior.log_metres) /
                  std::hypot(prior.size_sigma, scale->sigma));
  }
  return sum;
}

double Reliability(const ReliabilityEvidence& evidence) {
  constexpr double kUseless = 0.45;  // agreement of a box that is roughly in place
  constexpr double kUsualSigma = 0.25;
  constexpr double kUsualSurprise = 9.0;
  constexpr double kLabelIsWrong = 0.2;
  constexpr double kHalfConvinced = 10.0;  // boxes
  const double agreement = std::clamp((evidence.held_out_agreement - kUseless) / (1.0 - kUseless), 0.0, 1.0);
  const double sharpness = 1.0 / (1.0 + std::pow(evidence.log_size_sigma / kUsualSigma, 2));
  const double plausible =
      kLabelIsWrong + (1.0 - kLabelIsWrong) / (1.0 + evidence.class_surprise / kUsualSurprise);
  const double seen = evidence.observations / (evidence.observations + kHalfConvinced);
  return std::sqrt(agreement * plausible) * sharpness * seen;
}

}  // namespace sqslam
