#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>

namespace sqslam {

// Models of lens distortion, both OpenCV's: radial-tangential, and cv::fisheye (J. Kannala and S. Brandt, "A
// Generic Camera Model and Calibration Method for Conventional, Wide-Angle, and Fish-Eye Lenses", PAMI 2006;
// Kalibr, ROS: equidistant).
enum class LensModel : std::uint8_t { kRadialTangential, kFisheye };

// k1 k2 p1 p2 k3; for a fisheye lens k1 k2 k3 k4 0. T: a number, or a number with derivatives (ceres::Jet).
template <class T>
using LensCoefficients = std::array<T, 5>;

template <class T>
Eigen::Matrix<T, 2, 1> DistortRadialTangential(const LensCoefficients<T>& d,
                                               const Eigen::Matrix<T, 2, 1>& n) {
  const auto& [k1, k2, p1, p2, k3] = d;
  const T x = n.x();
  const T y = n.y();
  const T r2 = x * x + y * y;
  const T radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
  return {x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
          y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y};
}

// Returns the distance from the centre at which a fisheye lens shows a ray at `angle` to the axis, in focal
// lengths.
template <class T>
T FisheyeRadius(const LensCoefficients<T>& k, const T& angle) {
  const T a2 = angle * angle;
  return angle * (1.0 + a2 * (k[0] + a2 * (k[1] + a2 * (k[2] + a2 * k[3]))));
}

template <class T>
Eigen::Matrix<T, 2, 1> DistortFisheye(const LensCoefficients<T>& k, const Eigen::Matrix<T, 2, 1>& n) {
  using std::atan;
  using std::sqrt;
  constexpr double kOnAxis = 1e-24;  // squared distance from it
  const T r2 = n.x() * n.x() + n.y() * n.y();
  if (r2 <= kOnAxis) {
    return n;
  }
  const T radius = sqrt(r2);
  const T scale = FisheyeRadius(k, T(atan(radius))) / radius;
  return {scale * n.x(), scale * n.y()};
}

// Returns where a lens shows the ray through n (z = 1), in focal lengths from the principal point.
template <class T>
Eigen::Matrix<T, 2, 1> Distort(LensModel lens, const LensCoefficients<T>& coefficients,
                               const Eigen::Matrix<T, 2, 1>& n) {
  return lens == LensModel::kFisheye ? DistortFisheye(coefficients, n)
                                     : DistortRadialTangential(coefficients, n);
}

}  // namespace sqslam
