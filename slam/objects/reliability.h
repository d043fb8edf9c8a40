#pragma once

#include <Eigen/Core>
#include <optional>

#include "slam/geometry/superquadric.h"
#include "slam/objects/metric_scale.h"
#include "slam/objects/object_class.h"

namespace sqslam {

// Evidence for the reliability of an object's estimate.
struct ReliabilityEvidence {
  double observations = 0.0;        // boxes, see Landmark::Evidence()
  double held_out_agreement = 0.0;  // mean IoU with boxes that the fit did not use, in [0, 1]
  double log_size_sigma = 0.0;      // root mean square over the axes of sigma(half size) / half size
  double class_surprise = 0.0;      // chi square of size and proportions under the class's prior, three terms
};

// Chi square of the size and of the two ratios under the prior, each over its standard deviation.
double ClassSurprise(const Superquadric& shape, const ObjectClass& prior,
                     const std::optional<MetricScale>& scale);

// Returns a value in [0, 1] that increases with the mean 3D IoU of such objects (docs/evaluation.md).
double Reliability(const ReliabilityEvidence& evidence);

}  // namespace sqslam
