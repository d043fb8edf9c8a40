#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

// The norm whose unit sphere is a superquadric, with its derivatives. Both Eq. 2 of the paper and the support
// function are two nested p-norms, first of the horizontal section, then of its value and the profile:
// |(|(x, y)|_p2, z)|_p1, where p = 2 / e for Eq. 2 and p = 2 / (2 - e), the dual norm, for the support
// function. All forms factor out the larger of two terms, so that powers of 20 (e = 0.1) do not overflow, and
// the derivative by a coordinate that is zero is zero.
namespace sqslam {

// (|x|^p + |y|^p)^(1/p) with p = 2 / e.
inline double SuperellipseNorm(double x, double y, double e) {
  const double larger = std::max(std::abs(x), std::abs(y));
  if (larger == 0.0) {
    return 0.0;
  }
  const double ratio = std::min(std::abs(x), std::abs(y)) / larger;
  return larger * std::pow(1.0 + std::pow(ratio, 2.0 / e), 0.5 * e);
}

// (|x|^p + |y|^p)^(1/p), p >= 1, and its gradient: two powers, as many as for the value alone.
struct PNorm {
  double value = 0.0;
  double by_x = 0.0;
  double by_y = 0.0;

  PNorm(double x, double y, double p) {
    const double a = std::abs(x);
    const double b = std::abs(y);
    const double larger = std::max(a, b);
    if (larger == 0.0) {
      return;
    }
    const double ratio = std::min(a, b) / larger;
    const double power = ratio > 0.0 ? std::pow(ratio, p - 1.0) : 0.0;
    const double sum = 1.0 + power * ratio;
    const double growth = std::pow(sum, 1.0 / p);
    const double by_larger = growth / sum;
    const double by_smaller = by_larger * power;
    value = larger * growth;
    by_x = std::copysign(a >= b ? by_larger : by_smaller, x);
    by_y = std::copysign(a >= b ? by_smaller : by_larger, y);
  }
};

// The p-norm of (1, r), 0 < r <= 1, in logarithms: powers do not underflow.
struct LogPNorm {
  double value;                        // logarithm of the norm
  double share_larger, share_smaller;  // shares of the terms 1 and r^p in their sum
  double slope;                        // p times the derivative of `value` by p

  LogPNorm(double log_r, double p) {
    const double term = std::exp(p * log_r);
    value = std::log(1.0 + term) / p;
    share_larger = 1.0 / (1.0 + term);
    share_smaller = term / (1.0 + term);
    slope = share_larger * -value + share_smaller * (log_r - value);
  }
};

// As PNorm, with the derivative by p: for fits of exponents.
struct PNormWithSlope {
  double value = 0.0;
  double by_x = 0.0;
  double by_y = 0.0;
  double by_p = 0.0;

  PNormWithSlope(double x, double y, double p) {
    constexpr double kMinRatio = 1e-300;  // smaller ratios count as zero
    const double a = std::abs(x);
    const double b = std::abs(y);
    value = std::max(a, b);
    if (std::min(a, b) <= kMinRatio * value) {
      by_x = a > b ? std::copysign(1.0, x) : 0.0;
      by_y = b > a ? std::copysign(1.0, y) : 0.0;
      return;
    }
    const LogPNorm log_norm(std::log(std::min(a, b) / value), p);
    value *= std::exp(log_norm.value);
    by_x = std::copysign(value / a * (a >= b ? log_norm.share_larger : log_norm.share_smaller), x);
    by_y = std::copysign(value / b * (a >= b ? log_norm.share_smaller : log_norm.share_larger), y);
    by_p = value / p * log_norm.slope;
  }
};

// |(|(x, y)|_p2, z)|_p1; `Norm` is PNorm or PNormWithSlope.
template <typename Norm>
struct SuperquadricNorm {
  Norm section;
  Norm whole;

  SuperquadricNorm(const Eigen::Vector3d& u, double p1, double p2)
      : section(u.x(), u.y(), p2), whole(section.value, u.z(), p1) {}

  double Value() const { return whole.value; }
  Eigen::Vector3d Gradient() const {
    return {whole.by_x * section.by_x, whole.by_x * section.by_y, whole.by_y};
  }
};

// Returns the exponent of the dual of the norm with p = 2 / e. Bounded near e = 2, where the solid has
// ridges.
inline double DualPower(double e) { return 2.0 / (2.0 - std::min(e, 1.999)); }

}  // namespace sqslam
