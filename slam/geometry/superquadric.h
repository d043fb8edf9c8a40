#pragma once

#include <Eigen/Core>

#include "slam/geometry/rigid3.h"

namespace sqslam {

// Signed radial distance with its derivatives.
struct RadialDistanceGradient {
  double value = 0.0;
  Eigen::Vector3d by_point = Eigen::Vector3d::Zero();          // in the object frame
  Eigen::Vector3d by_log_half_size = Eigen::Vector3d::Zero();  // length
  double by_e1 = 0.0;                                          // length
  double by_e2 = 0.0;
};

inline constexpr double kMinShapeExponent = 0.1;
inline constexpr double kMaxShapeExponent = 1.9;

// Size and shape of a superquadric (superellipsoid) in its own frame, Eq. 1 of the paper. z is the axis of
// e1: e1 shapes the vertical profile, e2 the horizontal cross-section.
struct Superquadric {
  Eigen::Vector3d half_size = Eigen::Vector3d::Ones();  // a_x, a_y, a_z, in map units, > 0
  double e1 = 1.0;                                      // in [0.1, 1.9]
  double e2 = 1.0;                                      // in [0.1, 1.9]

  // Surface point at latitude eta in [-pi/2, pi/2] and longitude omega in [-pi, pi] (Eq. 1).
  Eigen::Vector3d PointAt(double eta, double omega) const;

  // Outward unit normal at the same parameters: the dual superquadric with exponents 2 - e.
  Eigen::Vector3d NormalAt(double eta, double omega) const;

  // Inside-outside function (Eq. 2): < 1 inside, 1 on the surface, > 1 outside. Saturates at the largest
  // double instead of overflowing (far points, small exponents).
  double F(const Eigen::Vector3d& p_object) const;

  // F^(e1/2): like F, but a norm of p (for e <= 2): homogeneous of degree 1, with the triangle inequality,
  // and free of overflow for small exponents. Defined on the axes and at the origin (0 there).
  double RadialScale(const Eigen::Vector3d& p_object) const;

  // Radial distance to the surface with sign, |p| (1 - F^(-e1/2)): negative inside, positive outside.
  // Its absolute value is G of the paper. At the centre: minus the smallest half size.
  double RadialDistance(const Eigen::Vector3d& p_object) const;
  RadialDistanceGradient RadialDistanceWithGradient(const Eigen::Vector3d& p_object) const;

  // Surface point that is farthest along n (object frame, any length but 0), and n . p there: gradient and
  // value of the support function. Exponents may be 0; returns the midpoint of an edge or face.
  Eigen::Vector3d SupportPoint(const Eigen::Vector3d& n_object) const;
  double SupportExtent(const Eigen::Vector3d& n_object) const;

  double Volume() const;  // closed form with the Beta function (Jaklic et al. 2000)

  // Means of x^2, y^2 and z^2 over the volume, of which moments of inertia consist; likewise.
  Eigen::Vector3d MeanSquares() const;
};

// A superquadric placed in the map: the 11 parameters of the paper (roll and pitch are zero for objects that
// stand on a support).
struct PosedSuperquadric {
  Superquadric shape;
  Rigid3d T_map_object;
};

// Transforms a superquadric into another frame and its unit of length.
PosedSuperquadric operator*(const Sim3d& S_new_map, const PosedSuperquadric& superquadric);

// Returns the surface point that is farthest along n (map frame, any length but 0).
Eigen::Vector3d SupportPoint(const PosedSuperquadric& superquadric, const Eigen::Vector3d& n_map);

// Returns the largest n . (p - centre) over the solid, in lengths of n (map frame).
double SupportExtent(const PosedSuperquadric& superquadric, const Eigen::Vector3d& n_map);

// The paper's Lambda (Eq. 3): (a_x, a_y, a_z, e1, e2, roll, pitch, yaw, t_x, t_y, t_z), map units and
// radians, with R_map_object = R_z(yaw) R_y(pitch) R_x(roll); roll and yaw in (-pi, pi], pitch in [-pi/2,
// pi/2].
using SuperquadricParameters = Eigen::Matrix<double, 11, 1>;
SuperquadricParameters ToParameters(const PosedSuperquadric& superquadric);

}  // namespace sqslam
