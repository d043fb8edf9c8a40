#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <numbers>

#include "slam/geometry/superquadric.h"

namespace sqslam {

// First-order signed distance of a point to the surface of a superquadric, negative inside.
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
template <typename T>
class SurfaceDistanceOf {
 public:
  using Vector = Eigen::Matrix<T, 3, 1>;

  SurfaceDistanceOf(const Vector& half_size, const T& e1, const T& e2)
      : half_size_(half_size), p1_(2.0 / e1), p2_(2.0 / e2) {}
  explicit SurfaceDistanceOf(const Superquadric& shape)
      : SurfaceDistanceOf(shape.half_size.cast<T>(), T(shape.e1), T(shape.e2)) {}

  // Evaluates the distance at p_object, in the units of the half sizes. Inlined for the Jets' sake.
  [[gnu::flatten]] T operator()(const Vector& p_object) const {
    using std::exp, std::log, std::sqrt;
    constexpr double kSmoothing = 3e-3;  // of the half size
    constexpr double kFarWeight = 4.0;   // of the term that grows with the cube of f - 1
    Vector logs;                         // of |x / a|
    Vector slopes;                       // their derivatives by x
    for (int i = 0; i < 3; ++i) {
      const T u = p_object[i] / half_size_[i];
      const T square = u * u + kSmoothing * kSmoothing;
      logs[i] = 0.5 * log(square);
      slopes[i] = u / (square * half_size_[i]);
    }
    const LogNorm section(logs.x(), logs.y(), p2_);
    const LogNorm profile(section.value, logs.z(), p1_);
    // Gradient of log f, of length 1 / (f H).
    const Vector gradient(profile.share_a * section.share_a * slopes.x(),
                          profile.share_a * section.share_b * slopes.y(), profile.share_b * slopes.z());
    const T square = gradient.squaredNorm();
    const T length = square > 1e-24 ? T(sqrt(square)) : T(1e-12);
    const T f = exp(profile.value < -30.0 ? T(-30.0) : profile.value > 30.0 ? T(30.0) : profile.value);
    const T g = f - 1.0;
    return g * (1.0 + kFarWeight * g * g) / (f * length);
  }

 private:
  // log of (exp(a)^p + exp(b)^p)^(1/p), and the shares of both terms.
  struct LogNorm {
    T value;
    T share_a, share_b;

    LogNorm(const T& a, const T& b, const T& p) {
      using std::exp, std::log;
      const bool a_larger = a > b;
      const T term = exp(p * (a_larger ? T(b - a) : T(a - b)));
      value = (a_larger ? a : b) + log(1.0 + term) / p;
      const T larger = 1.0 / (1.0 + term);
      const T smaller = term * larger;
      share_a = a_larger ? larger : smaller;
      share_b = a_larger ? smaller : larger;
    }
  };

  Vector half_size_;
  T p1_, p2_;
};
using SurfaceDistance = SurfaceDistanceOf<double>;

// Chords of the quarter curve |c|^(2/e) + |s|^(2/e) = 1: their midpoints and extents.
template <typename T>
struct QuarterChords {
  static constexpr int kSegments = 10;  // even, so that a chord ends at the corner of a box
  std::array<T, kSegments> c, s, dc, ds;

  explicit QuarterChords(const T& e) {
    using std::pow;
    std::array<T, kSegments + 1> x;
    std::array<T, kSegments + 1> y;
    for (int i = 0; i <= kSegments / 2; ++i) {
      const double tangent = std::tan(0.5 * std::numbers::pi * i / kSegments);
      x[i] = i == 0 ? T(1.0) : T(pow(1.0 + pow(tangent, 2.0 / e), -0.5 * e));
      y[i] = tangent * x[i];
      x[kSegments - i] = y[i];
      y[kSegments - i] = x[i];
    }
    for (int i = 0; i < kSegments; ++i) {
      c[i] = 0.5 * (x[i] + x[i + 1]), s[i] = 0.5 * (y[i] + y[i + 1]);
      dc[i] = x[i + 1] - x[i], ds[i] = y[i + 1] - y[i];
    }
  }
};

// Returns the log of the area of a superquadric by a coarse quadrature that is fast enough for an inner loop:
// accurate to 2 %.
template <typename T>
T LogSurfaceArea(const Eigen::Matrix<T, 3, 1>& half_size, const T& e1, const T& e2) {
  using std::log, std::sqrt;
  const QuarterChords<T> p(e1);
  const QuarterChords<T> q(e2);
  const Eigen::Matrix<T, 3, 1> faces(half_size.y() * half_size.z(), half_size.x() * half_size.z(),
                                     half_size.x() * half_size.y());
  T octant(0.0);
  for (int i = 0; i < p.kSegments; ++i) {
    for (int j = 0; j < q.kSegments; ++j) {
      const T x = faces.x() * (p.c[i] * p.ds[i] * q.ds[j]);
      const T y = faces.y() * (p.c[i] * p.ds[i] * q.dc[j]);
      const T z = faces.z() * (p.c[i] * p.dc[i] * (q.c[j] * q.ds[j] - q.s[j] * q.dc[j]));
      const T square = x * x + y * y + z * z;
      octant += square > 0.0 ? T(sqrt(square)) : T(0.0);
    }
  }
  return log(8.0 * octant);
}

}  // namespace sqslam
