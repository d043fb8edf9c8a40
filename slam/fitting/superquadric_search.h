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
  // Share of log(area) that each point adds to the cost, which constrains unobserved sides. 1 would be the
  // likelihood of points spread evenly over the whole surface, but makes half-seen objects too small.
  double search_area_weight = 0.3;  // during the search
  double area_weight = 0.2;         // in the final refinement
  int rotations = 24;               // start orientations, spread over those that differ for a box
  int search_points = 160;          // points that the search over starts uses
  int finalists = 6;                // candidates that are refined with all points
  int max_points = 4000;            // larger clouds are evenly thinned to this many points
  std::uint64_t seed = 0;           // of all random choices

  void VisitFields(auto&& visit) {
    visit("upright", upright);
    visit("outlier_share", outlier_share, 0.0, 0.8);
    visit("noise_floor", noise_floor, 1e-6, 0.1);
    visit("search_area_weight", search_area_weight, 0.0, 1.0);
    visit("area_weight", area_weight, 0.0, 1.0);
    visit("rotations", rotations, 1, 500);
    visit("search_points", search_points, 30, 5000);
    visit("finalists", finalists, 1, 100);
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
