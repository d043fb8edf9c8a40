#pragma once

#include <Eigen/Geometry>
#include <array>
#include <boost/math/quadrature/gauss.hpp>
#include <cmath>
#include <numbers>
#include <vector>

#include "slam/geometry/superquadric.h"
#include "slam/geometry/superquadric_norm.h"

namespace sqslam {

// A node of the quadrature along the quarter superellipse c^(2/e) + s^(2/e) = 1.
struct CurveNode {
  double c, s;    // point
  double dc, ds;  // derivative, times the weight of the node
};

// The quarter curve as (cos t, sin t) over its norm: unlike Eq. 1 its derivatives are bounded for every
// exponent. The substitution t = pi/4 v^3 (from either axis) flattens the remaining kink on the axes for
// e -> 2.
inline std::vector<CurveNode> QuarterCurve(double e) {
  using Gauss = boost::math::quadrature::gauss<double, 30>;
  std::vector<CurveNode> nodes;
  const auto add_node = [&](double v, double weight) {
    const double t = 0.25 * std::numbers::pi * v * v * v;
    const double dt = 0.75 * std::numbers::pi * v * v * weight;
    const PNorm norm(std::cos(t), std::sin(t), 2.0 / e);
    const double log_slope = (norm.by_y * std::cos(t) - norm.by_x * std::sin(t)) / norm.value;
    const double c = std::cos(t) / norm.value;
    const double s = std::sin(t) / norm.value;
    const double dc = (-s - c * log_slope) * dt;
    const double ds = (c - s * log_slope) * dt;
    nodes.push_back({c, s, dc, ds});
    nodes.push_back({s, c, ds, dc});  // the other half is the mirror image
  };
  for (std::size_t i = 0; i < Gauss::abscissa().size(); ++i) {
    const double x = Gauss::abscissa()[i];
    const double weight = 0.5 * Gauss::weights()[i];
    add_node(0.5 * (1.0 + x), weight);
    if (x != 0.0) {
      add_node(0.5 * (1.0 - x), weight);
    }
  }
  return nodes;
}

// The surface area of a superquadric, by quadrature of the parametric surface.
inline double SurfaceArea(const Superquadric& shape) {
  const auto [ax, ay, az] = std::array{shape.half_size.x(), shape.half_size.y(), shape.half_size.z()};
  const std::vector<CurveNode> profile = QuarterCurve(shape.e1);
  const std::vector<CurveNode> section = QuarterCurve(shape.e2);
  double octant = 0.0;
  for (const CurveNode& p : profile) {
    for (const CurveNode& q : section) {
      // Cross product of the tangents of (ax p.c q.c, ay p.c q.s, az p.s).
      const Eigen::Vector3d cross(-ay * az * p.ds * q.ds, ax * az * p.ds * q.dc,
                                  ax * ay * p.dc * (q.c * q.ds - q.s * q.dc));
      octant += p.c * cross.norm();
    }
  }
  return 8.0 * octant;
}

}  // namespace sqslam
