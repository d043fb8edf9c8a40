#include "slam/evaluation/footprint.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

namespace sqslam {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Polygon = std::vector<Vector2d>;  // convex, counterclockwise

constexpr int kOutlinePoints = 360;

// The exponents of a superquadric with the same surface; 0 gives sharp edges.
std::array<double, 2> ExponentsOf(const Solid& solid) {
  constexpr double kLargest = 1.999;  // at 2 the dual exponent is infinite
  switch (solid.kind) {
    case SolidKind::kSuperquadric:
      return {std::min(solid.e1, kLargest), std::min(solid.e2, kLargest)};
    case SolidKind::kCuboid:
      return {0.0, 0.0};
    case SolidKind::kCylinder:
      return {0.0, 1.0};
    case SolidKind::kEllipsoid:
      return {1.0, 1.0};
  }
  return {1.0, 1.0};
}

double Sign(double x) { return x > 0.0 ? 1.0 : x < 0.0 ? -1.0 : 0.0; }

// Length of (x, y), both >= 0, in the norm dual to that of a superellipse with exponent e, and the share of
// either coordinate in it: the gradient of the dual norm.
struct DualNorm {
  double norm = 0.0;
  double share_x = 0.0;
  double share_y = 0.0;
};

DualNorm DualNormOf(double x, double y, double e) {
  const double larger = std::max(x, y);
  if (larger <= 0.0) {
    return {};
  }
  const double q = 2.0 / (2.0 - e);  // from 1 (e = 0) up
  const double norm = larger * std::pow(std::pow(x / larger, q) + std::pow(y / larger, q), 1.0 / q);
  const auto share = [&](double v) { return v > 0.0 ? std::pow(v / norm, q - 1.0) : 0.0; };
  return {norm, share(x), share(y)};
}

// Most support points of an edgy solid are the same corner but for rounding, and an edge between two of those
// has no direction that means anything.
constexpr double kShortestEdge = 1e-6;  // share of the solid's largest half size

Polygon Outline(const Solid& solid, const Vector3d& u, const Vector3d& v) {
  Polygon polygon;
  polygon.reserve(kOutlinePoints);
  const double shortest = kShortestEdge * solid.half_size.maxCoeff();
  const Eigen::Quaterniond object_from_map = solid.T_map_object.rotation.conjugate();
  for (int i = 0; i < kOutlinePoints; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / kOutlinePoints;
    const Vector3d direction = std::cos(angle) * u + std::sin(angle) * v;
    const Vector3d p = solid.T_map_object * SupportPoint(solid, object_from_map * direction);
    const Vector2d corner(u.dot(p), v.dot(p));
    if (polygon.empty() || (corner - polygon.back()).norm() > shortest) {
      polygon.push_back(corner);
    }
  }
  while (polygon.size() > 1 && (polygon.front() - polygon.back()).norm() <= shortest) {
    polygon.pop_back();
  }
  return polygon;
}

double Cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

double Area(const Polygon& polygon) {
  double twice = 0.0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d& origin = polygon.front();  // keeps the terms small
    twice += Cross(polygon[i] - origin, polygon[(i + 1) % polygon.size()] - origin);
  }
  return 0.5 * twice;
}

// The part of `polygon` to the left of the line from a to b (Sutherland and Hodgman 1974).
Polygon Clip(const Polygon& polygon, const Vector2d& a, const Vector2d& b) {
  Polygon kept;
  kept.reserve(polygon.size() + 1);
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d& p = polygon[i];
    const Vector2d& q = polygon[(i + 1) % polygon.size()];
    const double side_p = Cross(b - a, p - a);
    const double side_q = Cross(b - a, q - a);
    if (side_p >= 0.0) {
      kept.push_back(p);
    }
    if ((side_p > 0.0 && side_q < 0.0) || (side_p < 0.0 && side_q > 0.0)) {
      kept.push_back(p + (q - p) * (side_p / (side_p - side_q)));
    }
  }
  return kept;
}

bool IsUsable(const Solid& solid) {
  return solid.half_size.allFinite() && solid.half_size.minCoeff() > 0.0 &&
         solid.T_map_object.translation.allFinite();
}

}  // namespace

// The gradient of the support function h(n) = |(|(a_x n_x, a_y n_y)|_q2, a_z n_z)|_q1, whose exponents
// q = 2 / (2 - e) are conjugate to those of the inside-outside function.
Vector3d SupportPoint(const Solid& solid, const Vector3d& direction) {
  const auto [e1, e2] = ExponentsOf(solid);
  const Vector3d n = solid.half_size.cwiseProduct(direction).cwiseAbs();
  const DualNorm section = DualNormOf(n.x(), n.y(), e2);
  const DualNorm whole = DualNormOf(section.norm, n.z(), e1);
  const Vector3d unit(Sign(direction.x()) * section.share_x * whole.share_x,
                      Sign(direction.y()) * section.share_y * whole.share_x,
                      Sign(direction.z()) * whole.share_y);
  return solid.half_size.cwiseProduct(unit);
}

double FootprintIoU(const Solid& a, const Solid& b, const Vector3d& up) {
  if (!IsUsable(a) || !IsUsable(b)) {
    return 0.0;
  }
  const Vector3d u = up.unitOrthogonal();
  const Vector3d v = up.cross(u);
  const Polygon outline_a = Outline(a, u, v);
  const Polygon outline_b = Outline(b, u, v);
  Polygon common = outline_a;
  for (std::size_t i = 0; i < outline_b.size() && !common.empty(); ++i) {
    common = Clip(common, outline_b[i], outline_b[(i + 1) % outline_b.size()]);
  }
  const double intersection = common.size() < 3 ? 0.0 : Area(common);
  const double together = Area(outline_a) + Area(outline_b) - intersection;
  return together > 0.0 ? std::clamp(intersection / together, 0.0, 1.0) : 0.0;
}

}  // namespace sqslam
