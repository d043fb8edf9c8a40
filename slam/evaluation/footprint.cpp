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

// Most support points of an edgy solid are the same corner but for rounding, and an edge between two of those
// has no direction that means anything.
constexpr double kShortestEdge = 1e-6;  // share of the solid's largest half size

Polygon Outline(const Solid& solid, const Vector3d& u, const Vector3d& v) {
  Polygon polygon;
  polygon.reserve(kOutlinePoints);
  const double shortest = kShortestEdge * solid.half_size.maxCoeff();
  const PosedSuperquadric superquadric = solid.ToSuperquadric();
  for (int i = 0; i < kOutlinePoints; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / kOutlinePoints;
    const Vector3d direction = std::cos(angle) * u + std::sin(angle) * v;
    const Vector3d p = SupportPoint(superquadric, direction);
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

}  // namespace

double FootprintIoU(const Solid& a, const Solid& b, const Vector3d& up) {
  if (!a.IsUsable() || !b.IsUsable()) {
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
