#pragma once

#include <Eigen/Core>

#include "slam/geometry/superquadric.h"

namespace sqslam {

// A part of an object: a superquadric along the axes of the object's hull, in the hull's unit box [-1, 1]^3.
struct SolidPart {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  // in half sizes of the hull
  Superquadric shape;                                // half sizes likewise
};

// Places a part of the hull in the map.
inline PosedSuperquadric PlacedIn(const PosedSuperquadric& hull, const SolidPart& part) {
  PosedSuperquadric placed{part.shape, hull.T_map_object};
  placed.shape.half_size = part.shape.half_size.cwiseProduct(hull.shape.half_size);
  placed.T_map_object.translation =
      hull.T_map_object * Eigen::Vector3d(part.centre.cwiseProduct(hull.shape.half_size));
  return placed;
}

}  // namespace sqslam
