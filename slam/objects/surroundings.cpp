#include "slam/objects/surroundings.h"

#include <algorithm>
#include <cmath>

#include "slam/objects/landmark_geometry.h"
#include "slam/objects/support.h"
#include "slam/objects/visibility.h"
#include "slam/util/statistics.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

// Horizontal gap between the two, share of the size of `other`.
double Gap(const PosedSuperquadric& other, const PosedSuperquadric& object) {
  Eigen::Vector3d p = other.T_map_object.Inverse() * object.T_map_object.translation;
  p.z() = 0.0;
  return other.shape.RadialDistance(p) / other.shape.half_size.norm();
}

// True if `other` may stand on the object: above it, on a surface `tolerance` from its top.
bool MayStandOn(const Landmark& other, const PosedSuperquadric& object, double tolerance) {
  if (!other.support) {
    return false;
  }
  const double top = object.T_map_object.translation.z() + object.shape.half_size.z();
  return std::abs(*other.support - top) < tolerance &&
         IsOver(other.superquadric.T_map_object.translation.head<2>(), object);
}

// True if `other` stands on the landmark and not on a wider one: cups over a chair that is pushed under a
// table stand on the table.
bool StandsOn(const Landmark& other, const Landmark& landmark, std::span<const Landmark* const> shown) {
  constexpr double kAbout = 0.15;  // of the landmark's height
  const auto area = [](const Landmark& l) { return l.superquadric.shape.half_size.head<2>().prod(); };
  const double tolerance = kAbout * 2.0 * landmark.superquadric.shape.half_size.z();
  return MayStandOn(other, landmark.superquadric, tolerance) &&
         std::ranges::none_of(shown, [&](const Landmark* third) {
           return third->id != other.id && area(*third) > area(landmark) &&
                  MayStandOn(other, third->superquadric, tolerance);
         });
}

// False for one that is cut off or hidden in its boxes: it would hide what stands beside it.
bool IsSizeKnown(const Landmark& landmark) {
  constexpr double kUncertain = 0.25;  // standard deviation of the logarithm
  return !landmark.refined || LogSizeSigma(landmark.superquadric.shape, landmark.covariance) < kUncertain;
}

}  // namespace

Surroundings SurroundingsOf(const Landmark& landmark, std::span<const Landmark* const> shown,
                            const ClassTable& classes) {
  constexpr double kMuchSmaller = 0.7;  // volumes
  constexpr double kNear = 0.5;
  Surroundings result;
  if (!landmark.estimated) {
    return result;
  }
  const bool on_floor = classes.Of(landmark.labels.Best()).on_floor;
  const double volume = landmark.superquadric.shape.Volume();
  double nearest = kNear;
  std::vector<double> tops;
  for (const Landmark* other : shown) {
    if (other->id == landmark.id) {
      continue;
    }
    result.others.push_back(other->superquadric);
    if (other->superquadric.shape.Volume() < kMuchSmaller * volume) {
      result.smaller.push_back(other->superquadric);
      if (StandsOn(*other, landmark, shown)) {
        tops.push_back(*other->support);
      }
    }
    if (IsSizeKnown(*other) && MayOcclude(other->superquadric, landmark.visible, on_floor)) {
      result.occluders.push_back(other->superquadric);
      const double gap = Gap(other->superquadric, landmark.visible);
      if (other->support && gap < nearest) {
        nearest = gap;
        result.hidden_support = other->support;
      }
    } else if (IsMuchLarger(other->superquadric.shape, landmark.visible.shape)) {
      result.beneath.push_back(other);
    }
  }
  if (!tops.empty()) {
    result.top_height = UpperMedian(std::move(tops));
  }
  return result;
}

Eigen::Vector3d DirectionToTableAxis(const PosedSuperquadric& table, const Eigen::Vector3d& p_map) {
  const Eigen::Vector3d p = table.T_map_object.Inverse() * p_map;
  const Eigen::Array2d half = table.shape.half_size.head<2>();
  const Eigen::Array2d reach = half - half.minCoeff();
  Eigen::Vector3d middle = p;
  middle.head<2>() = p.head<2>().array().max(-reach).min(reach);
  return table.T_map_object.rotation * (middle - p);
}

}  // namespace sqslam
