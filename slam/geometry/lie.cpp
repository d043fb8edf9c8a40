#include "slam/geometry/lie.h"

#include <Eigen/LU>
#include <cmath>
#include <limits>

namespace sqslam {
namespace {

// Integral of tau^n exp(sigma tau) over [0, 1]. All terms of both series are positive, so there is no
// cancellation at any sigma, including zero.
double ExponentialMoment(int n, double sigma) {
  const bool falls = sigma < 0.0;
  const double x = std::abs(sigma);
  double power = 1.0;  // x^k / k!, or for falling exponentials x^k n! / (n + k)!
  double sum = 0.0;
  for (int k = 0; k < 1000; ++k) {
    const double term = power / (n + k + 1);
    sum += term;
    if (term < std::numeric_limits<double>::epsilon() * sum) {
      break;
    }
    power *= x / (falls ? n + k + 1 : k + 1);
  }
  return falls ? std::exp(sigma) * sum : sum;
}

// Integral of exp(sigma tau) Exp(tau w) over [0, 1], which maps the translation part of a tangent vector to a
// translation.
Eigen::Matrix3d TranslationFactor(const Eigen::Vector3d& w, double sigma) {
  constexpr double kSmallAngle = 0.3;  // below, six terms in the angle are exact to rounding
  constexpr int kTerms = 6;
  const double angle = w.norm();
  const double c = sigma == 0.0 ? 1.0 : std::expm1(sigma) / sigma;
  double a = 0.0;  // of Skew(w)
  double b = 0.0;  // factor of Skew(w)^2
  if (angle < kSmallAngle) {
    double power = 1.0;  // (-angle^2)^k / (2k + 1)!
    for (int k = 0; k < kTerms; ++k) {
      a += power * ExponentialMoment(2 * k + 1, sigma);
      b += power / (2 * k + 2) * ExponentialMoment(2 * k + 2, sigma);
      power *= -angle * angle / ((2 * k + 2) * (2 * k + 3));
    }
  } else {
    const double scale = std::exp(sigma);
    const double sine = scale * std::sin(angle);
    const double cosine = scale * std::cos(angle) - 1.0;
    const double divisor = sigma * sigma + angle * angle;
    a = (sine * sigma - cosine * angle) / (divisor * angle);
    b = (c - (cosine * sigma + sine * angle) / divisor) / (angle * angle);
  }
  const Eigen::Matrix3d W = Skew(w);
  return c * Eigen::Matrix3d::Identity() + a * W + b * W * W;
}

}  // namespace

Sim3d ExpSim3(const Vector7d& x) {
  const Eigen::Vector3d w = x.head<3>();
  return {std::exp(x[6]), ExpRotation(w), TranslationFactor(w, x[6]) * x.segment<3>(3)};
}

Vector7d LogSim3(const Sim3d& S) {
  const Eigen::Vector3d w = LogRotation(S.rotation);
  const double sigma = std::log(S.scale);
  Vector7d x;
  x.head<3>() = w;
  x.segment<3>(3) = TranslationFactor(w, sigma).partialPivLu().solve(S.translation);
  x[6] = sigma;
  return x;
}

Matrix7d AdjointSim3(const Sim3d& S) {
  const Eigen::Matrix3d R = S.rotation.toRotationMatrix();
  Matrix7d adjoint = Matrix7d::Zero();
  adjoint.topLeftCorner<3, 3>() = R;
  adjoint.block<3, 3>(3, 0) = Skew(S.translation) * R;
  adjoint.block<3, 3>(3, 3) = S.scale * R;
  adjoint.block<3, 1>(3, 6) = -S.translation;
  adjoint(6, 6) = 1.0;
  return adjoint;
}

Matrix7d LeftJacobianSim3(const Vector7d& x) {
  Matrix7d ad = Matrix7d::Zero();
  ad.topLeftCorner<3, 3>() = Skew(x.head<3>());
  ad.block<3, 3>(3, 0) = Skew(x.segment<3>(3));
  ad.block<3, 3>(3, 3) = Skew(x.head<3>()) + x[6] * Eigen::Matrix3d::Identity();
  ad.block<3, 1>(3, 6) = -x.segment<3>(3);
  constexpr int kTerms = 12;
  int doublings = 0;
  for (double norm = ad.norm(); norm > 0.5 && doublings < 60; norm *= 0.5) {
    ++doublings;
    ad *= 0.5;
  }
  Matrix7d J = Matrix7d::Identity();
  for (int k = kTerms; k >= 2; --k) {
    J = (Matrix7d::Identity() + ad * J / k).eval();
  }
  for (; doublings > 0; --doublings) {
    J = (J + 0.5 * ad * (J * J)).eval();  // ad and J commute
    ad *= 2.0;
  }
  return J;
}

}  // namespace sqslam
