#pragma once

#include <Eigen/Core>
#include <span>

#include "slam/geometry/superquadric.h"

namespace sqslam {

// Parameters that FitPlaceAndSize may change beyond centre and half sizes.
struct FixedShapeFreedom {
  bool yaw = false;    // turn about the object's z axis
  bool round = false;  // the two half sizes across the z axis stay equal (those of `start` must be)
};

// The superquadric with the exponents and the orientation of `start` whose centre and half sizes bring its
// surface nearest to the points (frame and unit of T_map_object): least squares of SurfaceDistance with a
// Huber loss at 5 % of the mean half size, and a weak pull (10 % of the half size) of each of the six sides
// towards where it is in `start`, which decides about sides that no point shows. For comparing shapes fairly,
// each at its best. Returns `start` where there are no points.
PosedSuperquadric FitPlaceAndSize(std::span<const Eigen::Vector3d> p_map, const PosedSuperquadric& start,
                                  const FixedShapeFreedom& freedom = {});

// The cost of FitPlaceAndSize without the pull to `start`: the mean Huber loss of the points' distances
// over 5 % of `size` (map units), which must be the same where fits are compared.
double MeanPointCost(std::span<const Eigen::Vector3d> p_map, const PosedSuperquadric& superquadric,
                     double size);

}  // namespace sqslam
