#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "slam/geometry/superquadric.h"
#include "slam/objects/object_options.h"

namespace sqslam {

struct Extents {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();     // in the frame of the input points
  Eigen::Vector3d half_size = Eigen::Vector3d::Zero();  // > 0
};

// Estimates half sizes as half the difference of the largest and the smallest coordinate on each axis
// (section "Size And Shape"). Needs at least one point.
Extents EstimateExtents(std::span<const Eigen::Vector3d> p_object, const SizeShapeOptions& options);

// Returns the weights alpha of section "Size And Shape": 0 for the point nearest to the centre, 1 for the
// farthest.
std::vector<double> ShapeWeights(std::span<const Eigen::Vector3d> p_object);

struct ShapeFit {
  double e1 = 1.0;
  double e2 = 1.0;
  double cost = 0.0;  // alpha-weighted robust mean of the squared radial distance over the mean half size
};

// Fits the exponents for given half sizes: the best of a grid over [0.1, 1.9]^2, refined by
// Levenberg-Marquardt on the radial distance with weights alpha and a Huber loss.
ShapeFit FitShape(std::span<const Eigen::Vector3d> p_object, const Eigen::Vector3d& half_size,
                  const SizeShapeOptions& options);

// Returns the superquadric of points in the map frame at a given yaw: half sizes from their extent, and the
// exponents fitted if `with_shape` (otherwise an ellipsoid).
PosedSuperquadric SuperquadricAtYaw(std::span<const Eigen::Vector3d> p_map, double yaw,
                                    const SizeShapeOptions& options, bool with_shape = true);

}  // namespace sqslam
