#pragma once

#include <Eigen/Core>
#include <span>

#include "slam/geometry/superquadric.h"

namespace sqslam {

// The superquadric with the exponents and the orientation of `start` whose centre and half sizes bring its
// surface nearest to the points (frame and unit of T_map_object): least squares of SurfaceDistance with a
// Huber loss at 5 % of the mean half size, and a weak pull (10 % of the half size) of each of the six sides
// towards where it is in `start`, which decides about sides that no point shows. For comparing shapes fairly,
// each at its best. Returns `start` where there are no points.
PosedSuperquadric FitPlaceAndSize(std::span<const Eigen::Vector3d> p_map, const PosedSuperquadric& start);

}  // namespace sqslam
