#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "slam/fitting/superquadric_search.h"
#include "slam/geometry/superquadric.h"

namespace sqslam {

// For a cloud with several objects.
struct MultiFitOptions {
  FitOptions fit;
  bool remove_plane = false;      // take the largest plane (a table, the floor) away first
  double plane_distance = 0.01;   // of the plane's points from it, as a share of the cloud's radius
  int clusters = 1;               // objects: 1 takes the cloud as one, 0 finds out how many there are
  double cluster_distance = 2.5;  // gap that separates two objects, in typical distances between neighbours
  int min_cluster_points = 50;    // smaller heaps are no objects

  void VisitFields(auto&& visit) {
    visit("fit", fit);
    visit("remove_plane", remove_plane);
    visit("plane_distance", plane_distance, 1e-5, 0.5);
    visit("clusters", clusters, 0, 1000);
    visit("cluster_distance", cluster_distance, 0.1, 100.0);
    visit("min_cluster_points", min_cluster_points, 11, 1000000);
  }
};

// One superquadric of a cloud. The map frame is the cloud's, lengths in its unit.
struct SuperquadricFit {
  PosedSuperquadric superquadric;
  double rms = 0.0;           // of the radial distances of the inliers
  double noise = 0.0;         // estimated standard deviation of the inliers from the surface
  int points = 0;             // that the fit was made from: the cloud, or one cluster of it
  double inlier_share = 0.0;  // of those points
  double cost = 0.0;          // negative log likelihood; comparable between fits of one cloud
  std::vector<bool> inlier;   // for each point of the cloud
};

// Fits one superquadric in general pose (all 11 parameters) to a cloud with noise and outliers, of which only
// one side may be seen. Deterministic, independent of the order of the points, and commutes with similarities
// of the cloud. Throws InputError for fewer than 11 points, points that coincide or are not finite.
SuperquadricFit FitSuperquadric(std::span<const Eigen::Vector3d> cloud, const FitOptions& options);

// Fits a superquadric to each object of a cloud: the largest plane away if asked for, the rest split where
// there are gaps, largest cluster first. Properties and errors as above; InputError too where no cluster has
// enough points.
std::vector<SuperquadricFit> FitSuperquadrics(std::span<const Eigen::Vector3d> cloud,
                                              const MultiFitOptions& options);

}  // namespace sqslam
