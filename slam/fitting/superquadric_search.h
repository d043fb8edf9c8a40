#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "slam/fitting/mixture_fit.h"

namespace sqslam {

struct FitOptions {
  bool upright = false;        // keep the object's z axis on the cloud's z axis: only yaw is free
  double outlier_share = 0.1;  // expected share of points that do not belong to the object
  double noise_floor = 2e-3;   // lower bound on the noise, share of the cloud's radius
  int max_points = 4000;       // larger clouds are evenly thinned to this many points
  std::uint64_t seed = 0;      // of all random choices

  void VisitFields(auto&& visit) {
    visit("upright", upright);
    visit("outlier_share", outlier_share, 0.0, 0.8);
    visit("noise_floor", noise_floor, 1e-6, 0.1);
    visit("max_points", max_points, 100, 1000000);
    visit("seed", seed);
  }
};

struct SearchResult {
  PosedSuperquadric superquadric;
  MixtureModel model;
  double cost = 0.0;  // negative log likelihood, up to a constant of the cloud
};

// Fits one superquadric to points in their canonical frame (origin inside, size about 1): evaluates many
// starts over orientation, shape and axis of symmetry on a few points, refines the best on all of them, tries
// similar shapes from the best one, and returns the most likely.
SearchResult SearchSuperquadric(const std::vector<Eigen::Vector3d>& points, const FitOptions& options);

}  // namespace sqslam
