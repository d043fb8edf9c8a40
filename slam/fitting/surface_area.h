#pragma once

#include <Eigen/Core>

#include "slam/geometry/superquadric.h"

namespace sqslam {

// The area of a superquadric by a coarse quadrature, quick enough for the inside of an optimisation: good to
// 2 % against Superquadric::SurfaceArea. `gradient` may be null: of log(area), by log a_x, log a_y, log a_z,
// e1 and e2.
double LogSurfaceArea(const Superquadric& shape, Eigen::Matrix<double, 5, 1>* gradient = nullptr);

}  // namespace sqslam
