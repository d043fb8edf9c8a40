#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "slam/fitting/superquadric_search.h"
#include "slam/geometry/superquadric.h"

namespace sqslam {

// Options for a cloud with several objects.
struct MultiFitOptions {
  FitOptions fit;
  bool remove_plane = false;      // remove the largest plane (a table, the floor) first
  double plane_distance = 0.01;   // distance of its inliers, share of the cloud's radius
  int clusters = 1;               // number of objects; 1: no clustering, 0: as many as there are
  double cluster_distance = 2.5;  // gap that separates two objects, in typical distances between neighbours
  int min_cluster_points = 50;    // smaller clusters are dropped

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

// Finds the plane with the most points within `distance` (RANSAC, then least squares over these points).
// `horizontal`: only planes whose normal is within 15 degrees of z. Empty for fewer than three points or if
// no three of them span such a plane.
std::optional<Plane> FindLargestPlane(const std::vector<Eigen::Vector3d>& points, double distance,
                                      bool horizontal, std::uint64_t seed);

// Clusters the points with the given indices by density (Ester et al., KDD 1996). Points with eight
// neighbours within the radius are core points, which are connected within the radius. Other points join the
// nearest core point within the radius or, if there is none, are outliers. The radius is `distance` times the
// median distance to the eighth neighbour. Returns indices, largest cluster first.
std::vector<std::vector<std::size_t>> ClusterPoints(const std::vector<Eigen::Vector3d>& points,
                                                    const std::vector<std::size_t>& indices, double distance);

// One superquadric of a cloud. The map frame is the cloud's, lengths in its unit.
struct SuperquadricFit {
  PosedSuperquadric superquadric;
  double rms = 0.0;           // root mean square radial distance of the inliers
  double noise = 0.0;         // estimated standard deviation of the inliers from the surface
  int points = 0;             // number of fitted points: the cloud, or one cluster of it
  double inlier_share = 0.0;  // share of these points
  double cost = 0.0;          // negative log likelihood; comparable between fits of one cloud
  std::vector<bool> inlier;   // for each point of the cloud
};

// Fits one superquadric in general pose (all 11 parameters) to a cloud with noise and outliers, of which only
// one side may be seen. Deterministic, independent of the order of the points, and commutes with similarities
// of the cloud. Throws InputError for fewer than 11 points, points that coincide or are not finite.
SuperquadricFit FitSuperquadric(std::span<const Eigen::Vector3d> cloud, const FitOptions& options);

// Fits a superquadric to each object of a cloud: removes the largest plane if asked to, clusters the rest,
// largest cluster first. Properties and errors as above; also InputError if no cluster has enough points.
std::vector<SuperquadricFit> FitSuperquadrics(std::span<const Eigen::Vector3d> cloud,
                                              const MultiFitOptions& options);

}  // namespace sqslam
