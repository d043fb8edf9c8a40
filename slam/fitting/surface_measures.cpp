#include "slam/fitting/surface_measures.h"

#include <array>
#include <cmath>
#include <numbers>

#include "slam/geometry/superquadric_norm.h"

namespace sqslam {
namespace {

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
