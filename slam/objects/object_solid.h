#pragma once

#include <ceres/jet.h>
#include <ceres/rotation.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>

#include "slam/geometry/radial_distance.h"
#include "slam/geometry/superquadric.h"

namespace sqslam {

// Layout of an object's parameters: centre (map frame), logs of the half sizes, yaw (radians), exponents
// (through a sine, which keeps them between kMinShapeExponent and kMaxShapeExponent), the outward bias of the
// detector for each side of the boxes (share of the box size), logs of the tapers of the lower and the upper
// end, and, of objects that move, the displacement from the first view to the last (map frame), or of those
// that lean, a rotation about a horizontal axis (rotation vector in the frame that the yaw turns).
namespace parameter {
enum Index : int {
  kCentre = 0,
  kLogHalf = 3,
  kYaw = 6,
  kExponents = 7,
  kBias = 9,
  kTaper = 13,
  kCount = 15,  // upright and at rest
  kDisplacement = 15,
  kTilt = 15,
  kMostCount = 18,
};
}  // namespace parameter

inline constexpr double kExponentMiddle = 0.5 * (kMinShapeExponent + kMaxShapeExponent);
inline constexpr double kExponentReach = 0.5 * (kMaxShapeExponent - kMinShapeExponent);

// Exponents and the angles that stand for them. At the bounds the sine has no slope: angles keep off these.
template <typename T>
T ExponentOf(const T& angle) {
  using std::sin;
  return kExponentMiddle + kExponentReach * sin(angle);
}
inline double AngleOf(double exponent) {
  constexpr double kInside = 0.999;
  return std::asin(std::clamp((exponent - kExponentMiddle) / kExponentReach, -kInside, kInside));
}

// Variations of a superquadric.
struct SolidVariant {
  bool tapered = false;
  bool handled = false;
  bool moving = false;
  bool leaning = false;  // an ellipsoid in any orientation: the exponents are 1
};

// The solid that the parameters describe.
//
// Round things are seldom cylinders: the neck of a bottle, the foot of a bowl and the ends of a vase are
// narrower than the middle. A tapered solid has the superquadric's width in the middle and `taper` times that
// width at an end, linear between. Taper 1 is the superquadric itself, which touches the left and right edges
// of such a thing's boxes, but not the upper and lower ones.
//
// A cup is a round body with a handle on one side: no symmetric solid touches all its boxes, neither the
// narrow ones from where the handle is behind the body nor those it widens to the left or to the right only.
// `hull` bounds both; the handle is an upright bar at the end of the x axis, half as long as the hull is
// high. The body has the hull's width along y in both directions and lies at the other end of the x axis.
template <typename T>
struct ObjectSolid {
  Vector3<T> centre;  // map frame
  Vector3<T> hull;    // half sizes
  Vector3<T> body;    // half sizes; without a handle those of the hull
  T shift;            // from the centre to the body's, along x
  T cos_yaw, sin_yaw;
  T e1, e2;
  T p1, p2;                       // powers of the norm of Eq. 2, which e1 and e2 stand for
  T dual_p1, dual_p2;             // and of the support function's
  std::array<T, 2> taper;         // of the lower and the upper end
  Vector3<T> displacement;        // from the first view to the last, map frame; only if moving
  Eigen::Matrix<T, 3, 3> untilt;  // the inverse of the rotation before the yaw; only if leaning
  SolidVariant variant;

  ObjectSolid(const T* x, const SolidVariant& of_variant)
      : centre(x[parameter::kCentre], x[parameter::kCentre + 1], x[parameter::kCentre + 2]),
        variant(of_variant) {
    using std::cos, std::exp, std::sin;
    const T* log_half = x + parameter::kLogHalf;
    hull = {exp(log_half[0]), exp(log_half[1]), exp(log_half[2])};
    body = {variant.handled ? hull.y() : hull.x(), hull.y(), hull.z()};
    shift = body.x() - hull.x();
    cos_yaw = cos(x[parameter::kYaw]);
    sin_yaw = sin(x[parameter::kYaw]);
    e1 = ExponentOf(x[parameter::kExponents]);
    e2 = ExponentOf(x[parameter::kExponents + 1]);
    if (variant.leaning) {
      e1 = e2 = T(1.0);
      const T back[3] = {-x[parameter::kTilt], -x[parameter::kTilt + 1], T(0.0)};
      ceres::AngleAxisToRotationMatrix(back, untilt.data());
    }
    p1 = 2.0 / e1, p2 = 2.0 / e2;
    dual_p1 = 2.0 / (2.0 - e1), dual_p2 = 2.0 / (2.0 - e2);
    for (int i = 0; i < 2; ++i) {
      taper[i] = variant.tapered ? exp(x[parameter::kTaper + i]) : T(1.0);
    }
    if (variant.moving) {
      displacement = Eigen::Map<const Vector3<T>>(x + parameter::kDisplacement);
    }
  }

  Vector3<T> ToObject(const auto& v_map) const {
    const Vector3<T> turned(cos_yaw * v_map.x() + sin_yaw * v_map.y(),
                            cos_yaw * v_map.y() - sin_yaw * v_map.x(), T(v_map.z()));
    return variant.leaning ? Vector3<T>(untilt * turned) : turned;
  }

  // `time`: from -0.5 at the first view to 0.5 at the last.
  Vector3<T> CentreAt(double time) const {
    return variant.moving ? Vector3<T>(centre + time * displacement) : centre;
  }

  // Support function: the largest n . (p - centre), in lengths of n (map frame).
  T Support(const Eigen::Vector3d& n_map) const {
    using std::abs;
    const Vector3<T> n = ToObject(n_map);
    const Vector3<T> u = n.cwiseProduct(body);
    T extent;
    if (variant.tapered) {
      const T& narrow = taper[u.z() > 0.0 ? 1 : 0];
      extent = SolidNorm<T>(narrow * u.x(), narrow * u.y(), u.z(), dual_p1, dual_p2);
      const T middle = SolidNorm<T>(u.x(), u.y(), T(0.0), dual_p1, dual_p2);
      extent = narrow < 1.0 && middle > extent ? middle : extent;
    } else {
      extent = SolidNorm<T>(u.x(), u.y(), u.z(), dual_p1, dual_p2);
    }
    if (variant.handled) {
      extent += shift * n.x();
      const T handle = hull.x() * n.x() + 0.5 * hull.z() * abs(n.z());
      extent = handle > extent ? handle : extent;
    }
    return extent;
  }

  // The point in the frame of the body, with the taper undone.
  Vector3<T> ToBody(const Eigen::Vector3d& p_map) const {
    using std::abs;
    Vector3<T> p =
        ToObject(Vector3<T>(p_map.x() - centre.x(), p_map.y() - centre.y(), p_map.z() - centre.z()));
    if (variant.handled) {
      p.x() -= shift;
    }
    if (!variant.tapered) {
      return p;
    }
    const T& narrow = taper[p.z() > 0.0 ? 1 : 0];
    const T height = abs(p.z()) / body.z();
    const T width = 1.0 - (1.0 - narrow) * (height < 1.0 ? height : T(1.0));
    return {p.x() / width, p.y() / width, p.z()};
  }

  // Signed radial distance of ToBody(p) from the surface of the body.
  T RadialDistance(const Vector3<T>& p_body) const { return sqslam::RadialDistance<T>(p_body, body, p1, p2); }
};

using SolidParameters = Eigen::Matrix<double, parameter::kCount, 1>;

// Biases and tapers of the packed solid are zero; exponents at their bounds are moved slightly inside, as the
// sine has no slope there.
SolidParameters PackSolid(const PosedSuperquadric& superquadric);
PosedSuperquadric UnpackSolid(const SolidParameters& x);  // the hull

}  // namespace sqslam
