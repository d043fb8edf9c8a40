#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
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

struct Plane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // unit length
  double offset = 0.0;                                // normal . p on the plane

  double Distance(const Eigen::Vector3d& p) const { return normal.dot(p) - offset; }  // signed
};

// The plane with the most points within `distance` (RANSAC, then least squares over those points).
// `horizontal`: only planes whose normal is within 15 degrees of z. Empty where the points are fewer than
// three or no three of them span such a plane.
std::optional<Plane> FindLargestPlane(const std::vector<Eigen::Vector3d>& points, double distance,
                                      bool horizontal, std::uint64_t seed);

// Splits the points with the given indices where there are gaps (density-based clustering, Ester et al., KDD
// 1996). Two dense points within the radius belong together; a point is dense that has eight
// neighbours within the radius; one that is not dense goes with the nearest dense one within the
// radius, or to no cluster (stray outliers). The radius is `distance` times the median distance to the eighth
// neighbour. Returns indices, largest cluster first.
std::vector<std::vector<std::size_t>> ClusterPoints(const std::vector<Eigen::Vector3d>& points,
                                                    const std::vector<std::size_t>& indices, double distance);

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
