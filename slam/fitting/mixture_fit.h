#pragma once

#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "slam/geometry/superquadric.h"

namespace sqslam {

// Points on a surface with Gaussian noise, and uniform outliers. The cost of a point at distance d is
// -log((exp(-d^2 / (2 sigma^2)) + c) / (1 + c)): half the squared distance in sigmas near the surface,
// constant far from it.
struct MixtureModel {
  double sigma = 0.1;           // standard deviation of the noise, in the units of the points
  double outlier_ratio = 1e-2;  // c: density of outliers relative to that of the surface at distance 0

  template <typename T>
  T Cost(const T& distance) const {
    using std::expm1, std::log1p;
    return -log1p(expm1(-0.5 * distance * distance / (sigma * sigma)) / (1.0 + outlier_ratio));
  }
  double InlierProbability(double distance) const;
};

struct MixtureFit {
  PosedSuperquadric superquadric;  // T_map_object with the frame of the points as map
  double cost = 0.0;               // sum over the points, plus area_weight log(area), up to a constant
};

struct MixtureFitOptions {
  int max_iterations = 30;
  double parameter_tolerance = 1e-4;
  bool upright = false;  // rotates about the z axis of the frame only
  // Number of points on the surface: each adds log(area) to the cost. Prefers the smaller of two surfaces
  // through the same points, since less of it lacks points; without this term unobserved edges would be
  // unconstrained. 0: no area term.
  double area_weight = 0.0;
};

// Sum of the costs of all points.
double MixtureCost(const std::vector<Eigen::Vector3d>& points, const PosedSuperquadric& superquadric,
                   const MixtureModel& model);

// Minimises the cost over all 11 parameters from `start` by Levenberg-Marquardt, with exponents within their
// range.
MixtureFit FitMixture(const std::vector<Eigen::Vector3d>& points, const PosedSuperquadric& start,
                      const MixtureModel& model, const MixtureFitOptions& options);

}  // namespace sqslam
