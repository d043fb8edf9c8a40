#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <random>
#include <vector>

#include "slam/geometry/superquadric.h"

namespace sqslam::testing {

struct CloudOptions {
  int points = 1000;
  double outlier_share = 0.1;  // of the points: uniform in twice the bounding box
  double noise = 0.01;         // standard deviation over the mean of the object's three full sizes
  bool half_seen = true;       // only where the surface looks to a random direction
};

// Points spread evenly over the surface (by area), with noise and outliers.
std::vector<Eigen::Vector3d> SampleCloud(const PosedSuperquadric& superquadric, const CloudOptions& options,
                                         std::mt19937_64& random);

// Half sizes between 1 and `ratio`, a random orientation, a centre some sizes away from the origin.
PosedSuperquadric RandomlyPosed(double e1, double e2, double ratio, std::mt19937_64& random);

Eigen::Quaterniond RandomRotation(std::mt19937_64& random);

PosedSuperquadric Transformed(const Sim3d& S, const PosedSuperquadric& superquadric);

// Largest difference of any parameter, lengths relative to the mean half size of `a`.
double Difference(const PosedSuperquadric& a, const PosedSuperquadric& b);

}  // namespace sqslam::testing
