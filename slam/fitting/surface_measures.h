#pragma once

#include <Eigen/Core>

#include "slam/geometry/superquadric.h"

namespace sqslam {

// First-order signed distance of a point to the surface of a superquadric, with derivatives; negative inside.
// With f the norm F^(e1/2) and H the distance from the centre to the tangent plane where the ray through the
// point meets the surface, it is
//
//   d = (f - 1) (1 + 4 (f - 1)^2) H.
//
// (f - 1) H is the distance to that plane: near the surface it is the Euclidean distance, while the radial
// distance of flat shapes is many times as long. The second factor is 1 there, and keeps points far beyond
// the rim of a flat shape from being close to its plane. All powers are evaluated as logarithms, so that
// exponents near 0.1 (powers of 20) neither overflow nor underflow; coordinates are smoothed by 3e-3 of the
// half size. Shapes with exponents near 2 have ridges along their axes: with less smoothing the cost has a
// small local minimum wherever a point crosses a ridge, and rounding decides in which one a fit ends. The
// zero level is within 5e-3 of the size of the true surface on such a ridge, and far closer elsewhere.
class SurfaceDistance {
 public:
  explicit SurfaceDistance(const Superquadric& shape);

  struct Derivatives {
    Eigen::Vector3d by_point;          // in the object frame
    Eigen::Vector3d by_log_half_size;  // length
    double by_e1 = 0.0;                // length
    double by_e2 = 0.0;
  };

  // Evaluates the distance at p_object, in the units of the half sizes. `derivatives` may be null.
  double operator()(const Eigen::Vector3d& p_object, Derivatives* derivatives = nullptr) const;

 private:
  Eigen::Vector3d half_size_;
  Eigen::Vector3d log_half_size_;
  double e1_, e2_;
};

// Returns the log of the area of a superquadric by a coarse quadrature that is fast enough for an inner loop:
// accurate to 2 %. `gradient` (may be null): by log a_x, log a_y, log a_z, e1 and e2.
double LogSurfaceArea(const Superquadric& shape, Eigen::Matrix<double, 5, 1>* gradient = nullptr);

}  // namespace sqslam
