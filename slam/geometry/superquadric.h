#pragma once

#include <Eigen/Core>

#include "slam/geometry/rigid3.h"

namespace sqslam {

inline constexpr double kMinShapeExponent = 0.1;
inline constexpr double kMaxShapeExponent = 1.9;

// Size and shape of a superquadric (superellipsoid) in its own frame, Eq. 1 of the paper. z is the axis of e1:
// e1 shapes the vertical profile, e2 the horizontal cross-section.
struct Superquadric {
  Eigen::Vector3d half_size = Eigen::Vector3d::Ones();  // a_x, a_y, a_z, in map units, > 0
  double e1 = 1.0;                                      // in [0.1, 1.9]
  double e2 = 1.0;                                      // in [0.1, 1.9]

  // Surface point at latitude eta in [-pi/2, pi/2] and longitude omega in [-pi, pi] (Eq. 1).
  Eigen::Vector3d PointAt(double eta, double omega) const;

  // Outward unit normal at the same parameters: the dual superquadric with exponents 2 - e.
  Eigen::Vector3d NormalAt(double eta, double omega) const;

  // Inside-outside function (Eq. 2): < 1 inside, 1 on the surface, > 1 outside.
  double F(const Eigen::Vector3d& p_object) const;

  // F^(e1/2): like F, but a norm, i.e. homogeneous of degree 1 in p and free of overflow for small exponents.
  double RadialScale(const Eigen::Vector3d& p_object) const;

  // Radial distance to the surface with sign, |p| (1 - F^(-e1/2)): negative inside, positive outside.
  // Its absolute value is G of the paper. At the centre: minus the smallest half size.
  double RadialDistance(const Eigen::Vector3d& p_object) const;

  double Volume() const;       // closed form with the Beta function (Jaklic et al. 2000)
  double SurfaceArea() const;  // by quadrature of the parametric surface
};

// A superquadric placed in the map: the 11 parameters of the paper (roll and pitch are zero for objects that
// stand on a support).
struct PosedSuperquadric {
  Superquadric shape;
  Rigid3d T_map_object;
};

}  // namespace sqslam
