#pragma once

#include <algorithm>

#include "slam/geometry/superquadric.h"
#include "slam/objects/object_class.h"

namespace sqslam::app {

// Returns the mass of an object in kg: that of a typical one of its class, by the volumes of the boxes around
// both. `shape`: in metres.
inline double MassOf(const ObjectClass& traits, const Superquadric& shape) {
  constexpr double kMaxRatio = 4.0;          // of an object's volume to that of a typical one
  constexpr double kUnknownDensity = 300.0;  // kg/m^3, of classes without a mass
  if (traits.mass <= 0.0) {
    return kUnknownDensity * shape.Volume();
  }
  return traits.mass * std::clamp(8.0 * shape.half_size.prod() / traits.volume, 1.0 / kMaxRatio, kMaxRatio);
}

}  // namespace sqslam::app
