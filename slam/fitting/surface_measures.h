#pragma once

#include <Eigen/Core>

#include "slam/geometry/superquadric.h"

namespace sqslam {

// Signed distance of a point to the surface of a superquadric to first order, with derivatives. Negative
// inside. With f the norm F^(e1/2) and H the distance from the centre to the tangent plane where the ray
// through the point meets the surface, it is
//
//   d = (f - 1) (1 + 4 (f - 1)^2) H.
//
// (f - 1) H is the distance to that plane: near the surface the Euclidean distance, where the radial distance
// of flat shapes is many times as long. The second factor is 1 there and keeps points far beyond the rim of a
// flat shape from being near its plane. Everything is evaluated in logarithms, so that exponents near 0.1
// (powers of 20) neither overflow nor underflow; coordinates are smoothed by 3e-3 of the half size. Shapes
// with exponents near 2 have ridges along their axes: with sharper ones the cost has a small local minimum
// wherever a point crosses a ridge, and a fit ends in one or another by rounding. The zero level lies within
// 5e-3 of the size at the true surface on such a ridge, far closer elsewhere.
class SurfaceDistance {
 public:
  explicit SurfaceDistance(const Superquadric& shape);

  struct Derivatives {
    Eigen::Vector3d by_point;          // in the object frame
    Eigen::Vector3d by_log_half_size;  // length
    double by_e1 = 0.0;                // length
    double by_e2 = 0.0;
  };

  // At p_object, in the units of the half sizes. `derivatives` may be null.
  double operator()(const Eigen::Vector3d& p_object, Derivatives* derivatives = nullptr) const;

 private:
  Eigen::Vector3d half_size_;
  Eigen::Vector3d log_half_size_;
  double e1_, e2_;
};

// The area of a superquadric by a coarse quadrature, quick enough for the inside of an optimisation: good to
// 2 %. `gradient` may be null: of log(area), by log a_x, log a_y, log a_z, e1 and e2.
double LogSurfaceArea(const Superquadric& shape, Eigen::Matrix<double, 5, 1>* gradient = nullptr);

}  // namespace sqslam
