#pragma once

#include <ceres/jet.h>
#include <ceres/rotation.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <type_traits>
#include <vector>

#include "slam/geometry/radial_distance.h"
#include "slam/geometry/solid_part.h"
#include "slam/geometry/superquadric.h"
#include "slam/objects/part_template.h"

namespace sqslam {

// Layout of an object's parameters: centre (map frame), logs of the half sizes, yaw (radians), exponents
// (through a sine, which keeps them between kMinShapeExponent and kMaxShapeExponent), the outward bias of the
// detector for each side of the boxes (share of the box size), and logs of the tapers of the lower and the
// upper end. Some solids have more: those that move the displacement from the first view to the last (map
// frame), those that lean a rotation about a horizontal axis (rotation vector in the frame that the yaw
// turns), and those of parts the deviations of the proportions from their means.
namespace parameter {
enum Index : int {
  kCentre = 0,
  kLogHalf = 3,
  kYaw = 6,
  kExponents = 7,
  kBias = 9,
  kTaper = 13,
  kCount = 15,  // upright, at rest and of one part
  kDisplacement = 15,
  kTilt = 15,
  kProportions = 15,
  kMostCount = kProportions + static_cast<int>(kMaxProportions),
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
  bool moving = false;
  bool leaning = false;                 // an ellipsoid in any orientation: the exponents are 1
  const PartTemplate* parts = nullptr;  // of which the solid consists; null: one part, the hull

  int NumParameters() const {
    return moving || leaning || parts != nullptr ? parameter::kMostCount : parameter::kCount;
  }
};

// The solid that the parameters describe: the union of its parts in a common hull, whose half sizes are the
// object's. Parts of the kind of the first one have the exponents and tapers of the parameters.
//
// Round things are seldom cylinders: the neck of a bottle, the foot of a bowl and the ends of a vase are
// narrower than the middle. A tapered part has the superquadric's width in the middle and `taper` times that
// width at an end, linear between. Taper 1 is the superquadric itself, which touches the left and right edges
// of such a thing's boxes, but not the upper and lower ones.
template <typename T>
struct ObjectSolid {
  struct Part {
    Vector3<T> centre = Vector3<T>::Zero();  // from the hull's, object frame
    Vector3<T> half;
    T p1, p2;            // powers of the norm of Eq. 2, which e1 and e2 stand for
    T dual_p1, dual_p2;  // and of the support function's
    bool tapered = false;
    bool round = false;  // about z
  };

  Vector3<T> centre;  // map frame
  Vector3<T> hull;    // half sizes
  T cos_yaw, sin_yaw;
  T e1, e2;
  std::array<T, 2> taper;         // of the lower and the upper end
  Vector3<T> displacement;        // from the first view to the last, map frame; only if moving
  Eigen::Matrix<T, 3, 3> untilt;  // the inverse of the rotation before the yaw; only if leaning
  SolidVariant variant;
  std::array<Part, kMaxParts> parts;
  std::size_t num_parts = 1;

  ObjectSolid(const T* x, const SolidVariant& of_variant)
      : centre(x[parameter::kCentre], x[parameter::kCentre + 1], x[parameter::kCentre + 2]),
        variant(of_variant),
        values_(x, of_variant) {
    using std::cos, std::exp, std::sin;
    const T* log_half = x + parameter::kLogHalf;
    hull = {exp(log_half[0]), exp(log_half[1]), exp(log_half[2])};
    cos_yaw = cos(x[parameter::kYaw]);
    sin_yaw = sin(x[parameter::kYaw]);
    e1 = ExponentOf(x[parameter::kExponents]);
    e2 = ExponentOf(x[parameter::kExponents + 1]);
    if (variant.leaning) {
      e1 = e2 = T(1.0);
      const T back[3] = {-x[parameter::kTilt], -x[parameter::kTilt + 1], T(0.0)};
      ceres::AngleAxisToRotationMatrix(back, untilt.data());
    }
    for (int i = 0; i < 2; ++i) {
      taper[i] = variant.tapered ? exp(x[parameter::kTaper + i]) : T(1.0);
    }
    if (variant.moving) {
      displacement = Eigen::Map<const Vector3<T>>(x + parameter::kDisplacement);
    }
    parts[0].half = hull;
    SetShape(e1, e2, variant.tapered, parts[0]);
    if (variant.parts != nullptr) {
      PlaceParts(x + parameter::kProportions);
    }
  }

  // The same solid without derivatives.
  const ObjectSolid<double>& Values() const {
    if constexpr (std::is_same_v<T, double>) {
      return *this;
    } else {
      return values_.solid;
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
    return Support(parts[Values().FarthestPart(n_map)], ToObject(n_map));
  }

  // Signed radial distance of a point from the surface of the nearest part.
  T RadialDistance(const Eigen::Vector3d& p_map) const {
    return RadialDistance(parts[Values().NearestPart(p_map)], FromCentre(p_map));
  }

  bool IsInHull(const Eigen::Vector3d& p_map) const {
    const ObjectSolid<double>& values = Values();
    return (values.FromCentre(p_map).cwiseAbs() - values.hull).maxCoeff() <= 0.0;
  }

  // The part that reaches farthest along n. The support function of the part's box bounds its own.
  std::size_t FarthestPart(const Eigen::Vector3d& n_map) const {
    if (num_parts == 1) {
      return 0;
    }
    const Vector3<T> n = ToObject(n_map);
    const auto bound = [&](const Part& part) { return T(part.centre.dot(n) + n.cwiseAbs().dot(part.half)); };
    std::size_t farthest = Least([&](const Part& part) { return T(-bound(part)); });
    T extent = Support(parts[farthest], n);
    for (std::size_t i = 0; i < num_parts; ++i) {
      if (i != farthest && bound(parts[i]) > extent) {
        const T other = Support(parts[i], n);
        farthest = other > extent ? i : farthest;
        extent = other > extent ? other : extent;
      }
    }
    return farthest;
  }

  // The part whose surface is nearest to p, as if its edges were sharp.
  std::size_t NearestPart(const Eigen::Vector3d& p_map) const {
    if (num_parts == 1) {
      return 0;
    }
    const Vector3<T> p = FromCentre(p_map);
    return Least([&](const Part& part) {
      using std::abs;
      Vector3<T> beyond = (p - part.centre).cwiseAbs() - part.half;
      if (part.round) {
        const T across = (p - part.centre).template head<2>().norm();
        beyond.template head<2>().setConstant(across - part.half.x());
      }
      const T most = beyond.maxCoeff();
      return most > 0.0 ? T(beyond.cwiseMax(0.0).norm()) : T(-most);
    });
  }

 private:
  struct NoValues {
    NoValues(const T*, const SolidVariant&) {}
  };
  template <typename Value>
  struct ValuesOf {
    std::array<Value, parameter::kMostCount> x{};
    ObjectSolid<Value> solid;

    ValuesOf(const T* jets, const SolidVariant& variant)
        : solid(Fill(jets, variant.NumParameters()), variant) {}
    const Value* Fill(const T* jets, int count) {
      for (int i = 0; i < count; ++i) {
        x[static_cast<std::size_t>(i)] = jets[i].a;
      }
      return x.data();
    }
  };

  static void SetShape(const T& e1, const T& e2, bool tapered, Part& part) {
    part.p1 = 2.0 / e1, part.p2 = 2.0 / e2;
    part.dual_p1 = 2.0 / (2.0 - e1), part.dual_p2 = 2.0 / (2.0 - e2);
    part.tapered = tapered;
  }

  void PlaceParts(const T* deviations) {
    const T narrow = hull.x() < hull.y() ? hull.x() : hull.y();
    const Vector3<T> unit(narrow, narrow, hull.z());
    std::array<T, kMaxProportions> proportions;
    proportions.fill(T(0.0));
    for (std::size_t k = 0; k < variant.parts->free.size(); ++k) {
      proportions[k] = variant.parts->free[k].mean + deviations[k];
    }
    num_parts = variant.parts->parts.size();
    for (std::size_t i = 0; i < num_parts; ++i) {
      const TemplatePart& of = variant.parts->parts[i];
      for (int axis = 0; axis < 3; ++axis) {
        const auto& range = of.range[static_cast<std::size_t>(axis)];
        const T low = CoordinateAt<T>(range[0], proportions, hull[axis], unit[axis]);
        const T high = CoordinateAt<T>(range[1], proportions, hull[axis], unit[axis]);
        parts[i].centre[axis] = 0.5 * (low + high);
        parts[i].half[axis] = high - low > 2e-3 * hull[axis] ? T(0.5 * (high - low)) : T(1e-3 * hull[axis]);
      }
      parts[i].round = of.shape != SolidKind::kCuboid;
      if (of.shape == variant.parts->parts[0].shape) {
        SetShape(e1, e2, variant.tapered, parts[i]);
      } else {
        const auto [usual_e1, usual_e2] = UsualExponents(of.shape);
        SetShape(T(usual_e1), T(usual_e2), false, parts[i]);
      }
    }
  }

  std::size_t Least(const auto& of_part) const {
    std::size_t least = 0;
    T value = of_part(parts[0]);
    for (std::size_t i = 1; i < num_parts; ++i) {
      const T other = of_part(parts[i]);
      if (other < value) {
        value = other;
        least = i;
      }
    }
    return least;
  }

  Vector3<T> FromCentre(const Eigen::Vector3d& p_map) const {
    return ToObject(Vector3<T>(p_map.x() - centre.x(), p_map.y() - centre.y(), p_map.z() - centre.z()));
  }

  T Support(const Part& part, const Vector3<T>& n) const {
    const Vector3<T> u = n.cwiseProduct(part.half);
    T extent;
    if (part.tapered) {
      const T& narrow = taper[u.z() > 0.0 ? 1 : 0];
      extent = SolidNorm<T>(narrow * u.x(), narrow * u.y(), u.z(), part.dual_p1, part.dual_p2);
      const T middle = SolidNorm<T>(u.x(), u.y(), T(0.0), part.dual_p1, part.dual_p2);
      extent = narrow < 1.0 && middle > extent ? middle : extent;
    } else {
      extent = SolidNorm<T>(u.x(), u.y(), u.z(), part.dual_p1, part.dual_p2);
    }
    return num_parts == 1 ? extent : T(extent + part.centre.dot(n));
  }

  T RadialDistance(const Part& part, const Vector3<T>& p_object) const {
    using std::abs;
    Vector3<T> p = num_parts == 1 ? p_object : Vector3<T>(p_object - part.centre);
    if (part.tapered) {
      const T& narrow = taper[p.z() > 0.0 ? 1 : 0];
      const T height = abs(p.z()) / part.half.z();
      const T width = 1.0 - (1.0 - narrow) * (height < 1.0 ? height : T(1.0));
      p.x() = p.x() / width;
      p.y() = p.y() / width;
    }
    return sqslam::RadialDistance<T>(p, part.half, part.p1, part.p2);
  }

  std::conditional_t<std::is_same_v<T, double>, NoValues, ValuesOf<double>> values_;

  template <typename>
  friend struct ObjectSolid;
};

using SolidParameters = Eigen::Matrix<double, parameter::kCount, 1>;
using AllParameters = Eigen::Matrix<double, parameter::kMostCount, 1>;

// Biases and tapers of the packed solid are zero; exponents at their bounds are moved slightly inside, as the
// sine has no slope there.
SolidParameters PackSolid(const PosedSuperquadric& superquadric);
PosedSuperquadric UnpackSolid(const SolidParameters& x);  // the hull

// Returns the parts of a solid of several, in the unit box of its hull.
std::vector<SolidPart> UnpackParts(const AllParameters& x, const SolidVariant& variant);

}  // namespace sqslam
