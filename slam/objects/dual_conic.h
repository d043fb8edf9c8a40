#pragma once

// Outlines of ellipsoids in the image, for doubles and for Ceres' automatic derivatives. Normalised image
// coordinates are those on the plane at depth 1.

#include <array>
#include <cmath>
#include <cstddef>

namespace sqslam::conic {

enum Edge { kLeft, kTop, kRight, kBottom };

// Left, top, right and bottom on the image plane at depth 1 (normalised coordinates).
using Bounds = std::array<double, 4>;

// Symmetric matrix of a point or dual conic; w is the homogeneous coordinate.
template <typename T>
struct Conic {
  T xx, xy, xw, yy, yw, ww;

  Conic Adjugate() const {
    return {yy * ww - yw * yw, xw * yw - xy * ww, xy * yw - xw * yy,
            xx * ww - xw * xw, xw * xy - xx * yw, xx * yy - xy * xy};
  }
};

// The smallest box around points, as left, top, right, bottom.
template <typename T>
struct Hull {
  std::array<T, 4> bounds;
  bool empty = true;

  void Include(const T& x, const T& y) {
    if (empty) {
      bounds = {x, y, x, y};
      empty = false;
      return;
    }
    bounds[kLeft] = x < bounds[kLeft] ? x : bounds[kLeft];
    bounds[kTop] = y < bounds[kTop] ? y : bounds[kTop];
    bounds[kRight] = x > bounds[kRight] ? x : bounds[kRight];
    bounds[kBottom] = y > bounds[kBottom] ? y : bounds[kBottom];
  }
  void IncludeInside(const Bounds& image, const T& x, const T& y) {
    if (!(x < image[kLeft]) && !(x > image[kRight]) && !(y < image[kTop]) && !(y > image[kBottom])) {
      Include(x, y);
    }
  }
};

// Computes the other coordinate of the points where the ellipse crosses the line x = at (or y = at, with x
// and y of the conic swapped). Returns false if there are none.
template <typename T>
bool Crossings(const Conic<T>& points, double at, std::array<T, 2>& other) {
  using std::sqrt;
  const T half_b = points.xy * at + points.yw;
  const T c = points.xx * (at * at) + T(2.0) * at * points.xw + points.ww;
  const T discriminant = half_b * half_b - points.yy * c;
  if (!(discriminant > 1e-12 * half_b * half_b)) {
    return false;
  }
  const T root = sqrt(discriminant);
  other = {(-half_b - root) / points.yy, (-half_b + root) / points.yy};
  return true;
}

// Computes the bounds of the part of the ellipse within the image, which are tighter than the clipped bounds
// of the whole ellipse; the latter if no part of the outline is in the image. Returns false unless the dual
// conic is that of an ellipsoid clear of the camera's plane z = 0.
template <typename T>
bool VisibleBounds(const Conic<T>& dual, const Bounds& image, std::array<T, 4>& bounds) {
  using std::sqrt;
  const T x_radicand = dual.xw * dual.xw - dual.xx * dual.ww;
  const T y_radicand = dual.yw * dual.yw - dual.yy * dual.ww;
  if (!(dual.ww < 0.0) || !(x_radicand > 0.0) || !(y_radicand > 0.0)) {
    return false;
  }
  const T x_root = sqrt(x_radicand);
  const T y_root = sqrt(y_radicand);
  const std::array<T, 4> whole = {(dual.xw + x_root) / dual.ww, (dual.yw + y_root) / dual.ww,
                                  (dual.xw - x_root) / dual.ww, (dual.yw - y_root) / dual.ww};
  Hull<T> hull;
  for (const Edge edge : {kLeft, kRight}) {
    const T& x = whole[edge];  // touches at Q (1, 0, -x)
    hull.IncludeInside(image, x, T((dual.xy - x * dual.yw) / (dual.xw - x * dual.ww)));
  }
  for (const Edge edge : {kTop, kBottom}) {
    const T& y = whole[edge];
    hull.IncludeInside(image, T((dual.xy - y * dual.xw) / (dual.yw - y * dual.ww)), y);
  }
  const Conic<T> points = dual.Adjugate();
  const Conic<T> swapped = {points.yy, points.xy, points.yw, points.xx, points.xw, points.ww};
  std::array<T, 2> other;
  for (const Edge edge : {kLeft, kRight}) {
    if (Crossings(points, image[edge], other)) {
      hull.IncludeInside(image, T(image[edge]), other[0]);
      hull.IncludeInside(image, T(image[edge]), other[1]);
    }
  }
  for (const Edge edge : {kTop, kBottom}) {
    if (Crossings(swapped, image[edge], other)) {
      hull.IncludeInside(image, other[0], T(image[edge]));
      hull.IncludeInside(image, other[1], T(image[edge]));
    }
  }
  bounds = hull.empty ? whole : hull.bounds;
  return true;
}

// Computes the dual conic of an ellipsoid: Q* projected by [R | t]. `axes`: each camera axis in the
// ellipsoid's frame, times the half axes; `centre`: in the camera frame.
template <typename T>
Conic<T> DualConic(const std::array<std::array<T, 3>, 3>& axes, const std::array<T, 3>& centre) {
  const auto entry = [&](std::size_t i, std::size_t j) -> T {
    return axes[i][0] * axes[j][0] + axes[i][1] * axes[j][1] + axes[i][2] * axes[j][2] -
           centre[i] * centre[j];
  };
  return {entry(0, 0), entry(0, 1), entry(0, 2), entry(1, 1), entry(1, 2), entry(2, 2)};
}

}  // namespace sqslam::conic
