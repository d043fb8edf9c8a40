#pragma once

#include <Eigen/Core>
#include <span>

#include "slam/geometry/superquadric.h"

namespace sqslam {

// Parameters that FitPlaceAndSize may change in addition to centre and half sizes.
struct FixedShapeFreedom {
  bool yaw = false;    // rotation about the object's z axis
  bool round = false;  // keeps the half sizes along x and y equal (as those of `start` must be)
};

// Fits centre and half sizes of a superquadric with the exponents and the orientation of `start` to points
// (frame and unit of T_map_object): least squares of SurfaceDistance with a Huber loss at 5 % of the mean
// half size, and a weak prior (10 % of the half size) on each of the six sides to stay as in `start`, which
// decides about unobserved sides. For fair comparisons of shapes, each at its best. Returns `start` if there
// are no points.
PosedSuperquadric FitPlaceAndSize(std::span<const Eigen::Vector3d> p_map, const PosedSuperquadric& start,
                                  const FixedShapeFreedom& freedom = {});

// Returns the cost of FitPlaceAndSize without the prior: the mean Huber loss of the points' distances over 5
// % of `size` (map units), which must be the same for fits that are compared.
double MeanPointCost(std::span<const Eigen::Vector3d> p_map, const PosedSuperquadric& superquadric,
                     double size);

}  // namespace sqslam
