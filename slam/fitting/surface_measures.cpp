#include "slam/fitting/surface_measures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "slam/geometry/superquadric_norm.h"

namespace sqslam {
namespace {

using Eigen::Vector3d;

constexpr double kSmoothing = 3e-3;  // of the half size
constexpr double kFarWeight = 4.0;   // of the term that grows with the cube of f - 1

// log of (exp(a)^p + exp(b)^p)^(1/p), and the shares of both terms.
struct LogNorm {
  double value;
  double share_a, share_b;
  double by_p;

  LogNorm(double a, double b, double p) {
    const LogPNorm norm(-std::abs(a - b), p);
    value = std::max(a, b) + norm.value;
    share_a = a > b ? norm.share_larger : norm.share_smaller;
    share_b = a > b ? norm.share_smaller : norm.share_larger;
    by_p = norm.slope / p;
  }
};

constexpr int kSegments = 10;  // even, so that a chord ends at the corner of a box

// A chord of the quarter curve |c|^(2/e) + |s|^(2/e) = 1: its midpoint and its extent.
struct Chord {
  double c, s;
  double dc, ds;
};
using Curve = std::array<Chord, kSegments>;

Curve QuarterCurve(double e) {
  std::array<double, kSegments + 1> c;
  std::array<double, kSegments + 1> s;
  for (int i = 0; i <= kSegments / 2; ++i) {
    const double tangent = std::tan(0.5 * std::numbers::pi * i / kSegments);
    c[i] = 1.0 / SuperellipseNorm(1.0, tangent, e);
    s[i] = tangent * c[i];
    c[kSegments - i] = s[i];
    s[kSegments - i] = c[i];
  }
  Curve curve;
  for (int i = 0; i < kSegments; ++i) {
    curve[i] = {0.5 * (c[i] + c[i + 1]), 0.5 * (s[i] + s[i + 1]), c[i + 1] - c[i], s[i + 1] - s[i]};
  }
  return curve;
}

// Area of the octant, and its derivatives by the logarithms of the half sizes.
double OctantArea(const Eigen::Vector3d& a, const Curve& profile, const Curve& section,
                  Eigen::Vector3d* by_log_size) {
  const Eigen::Vector3d faces(a.y() * a.z(), a.x() * a.z(), a.x() * a.y());
  double area = 0.0;
  Eigen::Vector3d squares = Eigen::Vector3d::Zero();
  for (const Chord& p : profile) {
    for (const Chord& q : section) {
      const Eigen::Vector3d cross = faces.cwiseProduct(
          p.c * Eigen::Vector3d(-p.ds * q.ds, p.ds * q.dc, p.dc * (q.c * q.ds - q.s * q.dc)));
      const double norm = cross.norm();
      area += norm;
      if (by_log_size != nullptr && norm > 0.0) {
        squares += cross.cwiseProduct(cross) / norm;
      }
    }
  }
  if (by_log_size != nullptr) {
    *by_log_size = Eigen::Vector3d::Constant(area) - squares;
  }
  return area;
}

}  // namespace

SurfaceDistance::SurfaceDistance(const Superquadric& shape)
    : half_size_(shape.half_size),
      log_half_size_(shape.half_size.array().log()),
      e1_(shape.e1),
      e2_(shape.e2) {}

// Names: l = log|x / a|, s = dl/dx, w = shares in the norms, c = gradient of log f, G = |c| = 1 / (f H).
double SurfaceDistance::operator()(const Vector3d& p, Derivatives* derivatives) const {
  const double p1 = 2.0 / e1_;
  const double p2 = 2.0 / e2_;
  Vector3d l;
  Vector3d s;
  Vector3d square;  // x^2, smoothed
  Vector3d smoothing;
  for (int i = 0; i < 3; ++i) {
    smoothing[i] = kSmoothing * half_size_[i] * kSmoothing * half_size_[i];
    square[i] = p[i] * p[i] + smoothing[i];
    l[i] = 0.5 * std::log(square[i]) - log_half_size_[i];
    s[i] = p[i] / square[i];
  }
  const LogNorm section(l.x(), l.y(), p2);
  const LogNorm profile(section.value, l.z(), p1);
  const double vh = profile.share_a;
  const double vz = profile.share_b;
  const Vector3d share(vh * section.share_a, vh * section.share_b, vz);  // d(log f) / dl
  const Vector3d c = share.cwiseProduct(s);
  const double G = std::max(c.norm(), 1e-12);
  const double f = std::exp(std::clamp(profile.value, -30.0, 30.0));
  const double g = f - 1.0;
  const double H = 1.0 / (f * G);
  const double value = g * (1.0 + kFarWeight * g * g) * H;
  if (derivatives == nullptr) {
    return value;
  }
  // d = m(f) / (f G): dd = by_log_f dlog f - d dlog G.
  const double by_log_f = (1.0 + 3.0 * kFarWeight * g * g) / G - value;
  const Vector3d c2 = c.cwiseProduct(c) / (G * G);
  // log G through the shares: dlog vh = vz k, dlog vz = -vh k with k = d(p1 (log h - lz)), and in the same
  // way wx and wy with k2 = d(p2 (lx - ly)).
  const double of_k = c2.x() * vz + c2.y() * vz - c2.z() * vh;
  const double of_k2 = c2.x() * section.share_b - c2.y() * section.share_a;
  Vector3d log_G_by_l;
  log_G_by_l.x() = of_k * p1 * section.share_a + of_k2 * p2;
  log_G_by_l.y() = of_k * p1 * section.share_b - of_k2 * p2;
  log_G_by_l.z() = -of_k * p1;
  const Vector3d by_l = by_log_f * share - value * log_G_by_l;
  for (int i = 0; i < 3; ++i) {
    // log G through s itself: G dG = sum c share ds.
    const double of_s = -value * c[i] * share[i] / (G * G);
    const double s_by_x = (smoothing[i] - p[i] * p[i]) / (square[i] * square[i]);
    const double s_by_log_a = -2.0 * p[i] * smoothing[i] / (square[i] * square[i]);
    const double l_by_log_a = -p[i] * p[i] / square[i];
    derivatives->by_point[i] = by_l[i] * s[i] + of_s * s_by_x;
    derivatives->by_log_half_size[i] = by_l[i] * l_by_log_a + of_s * s_by_log_a;
  }
  const double p1_by_e1 = -0.5 * p1 * p1;
  const double p2_by_e2 = -0.5 * p2 * p2;
  derivatives->by_e1 = (by_log_f * profile.by_p - value * of_k * (section.value - l.z())) * p1_by_e1;
  derivatives->by_e2 =
      (by_log_f * vh * section.by_p - value * (of_k * p1 * section.by_p + of_k2 * (l.x() - l.y()))) *
      p2_by_e2;
  return value;
}

double LogSurfaceArea(const Superquadric& shape, Eigen::Matrix<double, 5, 1>* gradient) {
  const Curve profile = QuarterCurve(shape.e1);
  const Curve section = QuarterCurve(shape.e2);
  Eigen::Vector3d by_log_size;
  const double area =
      OctantArea(shape.half_size, profile, section, gradient == nullptr ? nullptr : &by_log_size);
  if (gradient != nullptr) {
    constexpr double kStep = 1e-4;
    gradient->head<3>() = by_log_size / area;
    (*gradient)[3] = (OctantArea(shape.half_size, QuarterCurve(shape.e1 + kStep), section, nullptr) -
                      OctantArea(shape.half_size, QuarterCurve(shape.e1 - kStep), section, nullptr)) /
                     (2.0 * kStep * area);
    (*gradient)[4] = (OctantArea(shape.half_size, profile, QuarterCurve(shape.e2 + kStep), nullptr) -
                      OctantArea(shape.half_size, profile, QuarterCurve(shape.e2 - kStep), nullptr)) /
                     (2.0 * kStep * area);
  }
  return std::log(8.0 * area);
}

}  // namespace sqslam
