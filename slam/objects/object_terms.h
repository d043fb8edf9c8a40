#pragma once

#include <Eigen/Core>
#include <cmath>
#include <numbers>

#include "slam/objects/object_solid.h"

// The terms of an object's energy, which is half the sum of their squares. Each is a struct whose call
// operator returns one residual of the solid and its parameters, as numbers or as Jets. Losses are part of
// the residuals, which are signed square roots of their robust costs. A `factor` is the inverse of a standard
// deviation.
//
// The density of a prior at its residual r is exp(-r^2 / 2 - LogNormaliser()). Hypotheses about an object
// have different priors, so their costs are comparable only with these.
namespace sqslam {

// Logarithm of the integral of exp(-(factor x)^2 / 2).
inline double LogGaussianIntegral(double factor) {
  return 0.5 * std::log(2.0 * std::numbers::pi) - std::log(factor);
}

// Returns the residual whose square is the positive robust cost; `slope_at_zero`: its derivative there, where
// the root has none.
template <typename T>
T SignedRoot(const T& cost, const T& r, double slope_at_zero) {
  using std::sqrt;
  if (cost < 1e-9) {
    return slope_at_zero * r;
  }
  return r < 0.0 ? T(-sqrt(cost)) : T(sqrt(cost));
}

// Signed square root of weight * Cauchy loss of this width.
template <typename T>
T Robust(const T& r, double width, double weight = 1.0) {
  using std::log;
  return std::sqrt(weight) * width * SignedRoot<T>(log(1.0 + r * r / (width * width)), r, 1.0 / width);
}

// A plane through the camera centre and a box edge touches the solid; if the edge is hidden or cut off, the
// solid reaches at least to the plane. The plane's gap to the solid is n . c + h(n), with the solid's centre
// c, the plane's normal n and the support function h: exact, smooth, and no silhouette has to be traced.
struct EdgeTerm {
  Eigen::Vector3d normal_map;     // outward, scaled so that n . p is the offset in the image times depth
  Eigen::Vector3d camera_centre;  // map frame
  Eigen::Vector3d forward_map;    // viewing direction
  double factor;                  // focal length over standard deviation, both px
  int side;                       // 0 left, 1 top, 2 right, 3 bottom
  double size;                    // box size across the edge, in standard deviations
  bool exact;                     // false: the silhouette reaches at least to the edge
  bool whole;                     // the box shows the whole object: none of its edges is hidden or cut off
  double time = 0.0;              // from -0.5 at the first view to 0.5 at the last
  bool symmetric = false;         // overshooting the edge costs as much as falling short of it

  template <typename T>
  T operator()(const ObjectSolid<T>& solid, const T* x) const {
    constexpr double kWidth = 1.5;
    constexpr double kBeyondWidth = 0.7;  // what hides or cuts off one edge may shorten the others
    const Vector3<T> offset = solid.CentreAt(time) - camera_centre.cast<T>();
    const T depth =
        forward_map.x() * offset.x() + forward_map.y() * offset.y() + forward_map.z() * offset.z();
    T r(1e3);  // behind the camera: no step leads here
    if (depth >= 1e-6) {
      const T gap = normal_map.x() * offset.x() + normal_map.y() * offset.y() + normal_map.z() * offset.z() +
                    solid.Support(normal_map);
      r = factor / depth * gap + size * x[parameter::kBias + side];
      if (!exact && r > 0.0) {
        return T(0.0);
      }
    }
    return Robust(r, r > 0.0 && !symmetric ? kBeyondWidth : kWidth);
  }
};

// A point on the surface, or one that lies outside of it: radial distance (Eq. 11).
struct PointTerm {
  Eigen::Vector3d p_map;
  double factor;  // per map unit
  double weight;
  bool on_surface;

  template <typename T>
  T operator()(const ObjectSolid<T>& solid, const T*) const {
    constexpr double kWidth = 1.5;
    constexpr double kInside = 0.5;  // objects are more often hollow between their parts than bulging
    if (!on_surface && !solid.IsInHull(p_map)) {
      return T(0.0);
    }
    const T r = factor * solid.RadialDistance(p_map);
    if (!on_surface && r > 0.0) {
      return T(0.0);
    }
    const bool inside = on_surface && solid.num_parts == 1 && r < 0.0;
    return Robust(inside ? T(kInside * r) : r, kWidth, weight);
  }
};

// Scales residuals whose noise is known up to a factor, the same for all: how well a superquadric follows the
// surface differs from object to object. The sum S of their squares becomes (n + a) log(1 + S / a), that of a
// t-distribution with a degrees of freedom. `n`: the number of independent residuals.
template <typename T>
void ShareNoise(double n, T* begin, T* end) {
  constexpr double kPrior = 0.25;  // a / n
  using std::log, std::sqrt;
  const double a = kPrior * n;
  T sum(0.0);
  for (const T* r = begin; r != end; ++r) {
    sum += *r * *r;
  }
  const T scale = sum < 1e-9 * n ? T(std::sqrt((n + a) / a)) : T(sqrt((n + a) * log(1.0 + sum / a) / sum));
  for (T* r = begin; r != end; ++r) {
    *r *= scale;
  }
}

// The lowest point (side -1) or the highest (side 1) is at this height, or if not `exact` not below it.
struct ContactTerm {
  double height;
  double factor;  // per map unit
  bool exact;
  double side;
  double range = 1.0;  // heights over which the point lies evenly without contact, map units

  template <typename T>
  T operator()(const ObjectSolid<T>& solid, const T*) const {
    const T r = factor * (solid.centre.z() + side * solid.hull.z() - height);
    return !exact && r > 0.0 ? T(0.0) : r;
  }

  // Relative to no contact.
  double LogNormaliser() const { return exact ? LogGaussianIntegral(factor) - std::log(range) : 0.0; }
};

// A proportion or the size of the class: a sum of the logs of the half sizes.
struct ClassTerm {
  Eigen::Vector3d weights;
  double expected;
  double factor;

  template <typename T>
  T operator()(const ObjectSolid<T>&, const T* x) const {
    constexpr double kWidth = 2.0;  // labels may be wrong, objects may lie on their side
    const T* log_half = x + parameter::kLogHalf;
    return Robust<T>(
        factor * (weights[0] * log_half[0] + weights[1] * log_half[1] + weights[2] * log_half[2] - expected),
        kWidth);
  }

  // The integral of the Cauchy loss's (1 + (factor x / 2)^2)^-2.
  double LogNormaliser() const { return std::log(std::numbers::pi / factor); }
};

inline const Eigen::Vector3d kWidthRatio(1.0, -1.0,
                                         0.0);  // weights of the half size along x over that along y

// The exponent of the kind of shape.
struct ExponentTerm {
  int index;  // 0: e1, 1: e2
  double expected;
  double factor;

  template <typename T>
  T operator()(const ObjectSolid<T>& solid, const T*) const {
    return factor * ((index == 0 ? solid.e1 : solid.e2) - expected);
  }

  double LogNormaliser() const { return LogGaussianIntegral(factor); }
};

// The yaw of the lines, modulo 90 degrees: a normal distribution mixed with an even one, of the objects whose
// lines tell nothing, as those of a pattern.
struct YawTerm {
  double yaw;
  double factor;

  static constexpr double kMisled = 0.2;  // share of these objects

  // Density of the even distribution over the peak of the normal one.
  double Even() const {
    return kMisled / (1.0 - kMisled) * 2.0 / std::numbers::pi * std::exp(LogGaussianIntegral(factor));
  }

  template <typename T>
  T operator()(const ObjectSolid<T>&, const T* x) const {
    using std::exp, std::log, std::sin;
    const double even = Even();
    const T r = factor * sin(2.0 * (x[parameter::kYaw] - yaw)) / 2.0;
    return SignedRoot<T>(-2.0 * log((exp(-0.5 * r * r) + even) / (1.0 + even)), r,
                         1.0 / std::sqrt(1.0 + even));
  }

  double LogNormaliser() const {
    return LogGaussianIntegral(factor) - std::log((1.0 - kMisled) * (1.0 + Even()));
  }
};

// A normal prior about zero: the detector's biases, the tapers, whose ends are no wider than the middle, and
// the displacement.
struct NormalTerm {
  int index;
  double factor;
  double factor_above;  // for values above zero

  template <typename T>
  T operator()(const ObjectSolid<T>&, const T* x) const {
    return (x[index] > 0.0 ? factor_above : factor) * x[index];
  }

  double LogNormaliser() const { return LogGaussianIntegral(factor); }
};

// Bounds of the log of a half size.
struct BoundTerm {
  int axis;
  double least;
  double most;

  template <typename T>
  T operator()(const ObjectSolid<T>&, const T* x) const {
    constexpr double kFactor = 20.0;
    const T& log_half = x[parameter::kLogHalf + axis];
    if (log_half > most) {
      return kFactor * (log_half - most);
    }
    return log_half < least ? T(kFactor * (log_half - least)) : T(0.0);
  }
};

}  // namespace sqslam
