#pragma once

#include <optional>
#include <span>
#include <vector>

#include "slam/geometry/superquadric.h"
#include "slam/objects/landmark.h"
#include "slam/objects/object_class.h"

namespace sqslam {

// Natural logarithm of metres per map unit.
struct MetricScale {
  double log_scale = 0.0;
  double sigma = 0.0;
};

// Mean of the logarithms of the three full sizes.
double LogSize(const Superquadric& shape);

// Estimates the map's scale from an object whose class has a metric size; empty for others, and for one that
// has its depth from its class. The fit knew the size of the class, so only the information beyond it counts.
std::optional<MetricScale> ScaleFrom(const Landmark& landmark, const ClassTable& classes);

// Combines estimates with Cauchy weights; empty for fewer than three.
std::optional<MetricScale> CombinedScale(std::vector<MetricScale> estimates);

// Estimates the map's scale from all landmarks but `excluded`.
std::optional<MetricScale> ScaleOfMap(std::span<const Landmark* const> landmarks, const ClassTable& classes,
                                      const Landmark* excluded = nullptr);

}  // namespace sqslam
