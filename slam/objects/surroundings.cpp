#include "slam/objects/surroundings.h"

#include "slam/objects/occlusion.h"

namespace sqslam {
namespace {

// Gap between the two seen from above, share of the other one's size.
double Gap(const PosedSuperquadric& other, const PosedSuperquadric& object) {
  Eigen::Vector3d p = other.T_map_object.Inverse() * object.T_map_object.translation;
  p.z() = 0.0;
  return other.shape.RadialDistance(p) / other.shape.half_size.norm();
}

}  // namespace

Surroundings SurroundingsOf(const Landmark& landmark, std::span<const Landmark* const> shown) {
  constexpr double kMuchSmaller = 0.7;  // volumes
  constexpr double kNear = 0.5;
  Surroundings result;
  if (!landmark.estimated) {
    return result;
  }
  const double volume = landmark.superquadric.shape.Volume();
  double nearest = kNear;
  for (const Landmark* other : shown) {
    if (other->id == landmark.id) {
      continue;
    }
    if (other->superquadric.shape.Volume() < kMuchSmaller * volume) {
      result.smaller.push_back(other->superquadric);
    }
    if (MayHide(other->superquadric, landmark.visible)) {
      result.hiders.push_back(other->superquadric);
      const double gap = Gap(other->superquadric, landmark.visible);
      if (other->support && gap < nearest) {
        nearest = gap;
        result.hidden_support = other->support;
      }
    }
  }
  return result;
}

}  // namespace sqslam
