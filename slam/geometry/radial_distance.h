#pragma once

#include <Eigen/Core>
#include <cmath>
#include <type_traits>

#include "slam/geometry/superquadric_norm.h"

namespace sqslam {

template <typename T>
using Vector3 = Eigen::Matrix<T, 3, 1>;

// The norm whose unit sphere is a superquadric, for numbers and for Jets (ceres/jet.h): |(|(x, y)|_p2,
// z)|_p1.
template <typename T>
T SolidNorm(const T& x, const T& y, const T& z, const T& p1, const T& p2) {
  if constexpr (std::is_same_v<T, double>) {
    return SuperquadricNorm<PNormWithSlope>({x, y, z}, p1, p2).Value();
  } else {
    const SuperquadricNorm<PNormWithSlope> norm({x.a, y.a, z.a}, p1.a, p2.a);
    const auto& [section, whole] = norm;
    return T(whole.value, whole.by_x * (section.by_x * x.v + section.by_y * y.v + section.by_p * p2.v) +
                              whole.by_y * z.v + whole.by_p * p1.v);
  }
}

// Signed radial distance of a point in the frame of a superquadric from its surface (Eq. 11), negative
// inside; at the centre minus the smallest half size. `p1`, `p2`: powers 2 / e1 and 2 / e2.
template <typename T>
T RadialDistance(const Vector3<T>& p, const Vector3<T>& half_size, const T& p1, const T& p2) {
  using std::sqrt;
  const Vector3<T> unit = p.cwiseQuotient(half_size);
  const T scale = SolidNorm<T>(unit.x(), unit.y(), unit.z(), p1, p2);
  return scale > 0.0 ? T(sqrt(p.squaredNorm()) * (1.0 - 1.0 / scale)) : T(-half_size.minCoeff());
}

}  // namespace sqslam
