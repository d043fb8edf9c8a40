#pragma once

// Superquadric formulas for Ceres' automatic derivatives. The value agrees with slam/geometry/superquadric.h;
// the absolute values are smoothed by a millionth of the size, so that derivatives exist on the axes.

#include <Eigen/Core>
#include <cmath>

namespace sqslam::jet {

template <typename T>
T SmoothAbs(const T& x) {
  using std::sqrt;
  return sqrt(x * x + 1e-12);
}

// (|x|^p + |y|^p)^(1/p), safe against overflow.
template <typename T>
T PNorm(const T& x, const T& y, const T& p) {
  using std::pow;
  const T a = SmoothAbs(x);
  const T b = SmoothAbs(y);
  if (a > b) {
    return a * pow(T(1.0) + pow(b / a, p), T(1.0) / p);
  }
  return b * pow(T(1.0) + pow(a / b, p), T(1.0) / p);
}

// F^(e1/2) (see Superquadric::RadialScale): 1 on the surface. half: a_x, a_y, a_z.
template <typename T>
T RadialScale(const T* half, const T& e1, const T& e2, const T* p) {
  const T horizontal = PNorm(T(p[0] / half[0]), T(p[1] / half[1]), T(2.0 / e2));
  return PNorm(horizontal, T(p[2] / half[2]), T(2.0 / e1));
}

// Signed radial distance |p| (1 - F^(-e1/2)).
template <typename T>
T RadialDistance(const T* half, const T& e1, const T& e2, const T* p) {
  using std::sqrt;
  const T norm = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2] + 1e-12);
  return norm * (T(1.0) - T(1.0) / RadialScale(half, e1, e2, p));
}

// Support function h(n) = max over the surface of n . p: the dual norm of F^(e1/2), a superquadric norm again
// with exponents 2 - e and the half sizes as factors. n need not be of unit length (h is homogeneous).
template <typename T>
T SupportFunction(const T* half, const T& e1, const T& e2, const T* n) {
  const T horizontal = PNorm(T(n[0] * half[0]), T(n[1] * half[1]), T(2.0 / (2.0 - e2)));
  return PNorm(horizontal, T(n[2] * half[2]), T(2.0 / (2.0 - e1)));
}

}  // namespace sqslam::jet
