#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "slam/geometry/superquadric.h"

namespace sqslam {

// The drawing order of translucent superquadrics, in which nearer ones cover farther ones. If a plane
// separates two convex solids, the one on the camera's side is drawn later; interpenetrating solids are
// ordered by the plane in the middle of their overlap. The order does not depend on the numbering of the
// solids. Thousands of solids are ordered by distance alone, as their pairs would take too much time and
// memory.
class SolidOrder {
 public:
  SolidOrder() = default;

  // Finds the separating planes, which are the same for all views.
  explicit SolidOrder(std::vector<PosedSuperquadric> solids);

  // Returns the indices of the solids, farthest first.
  std::vector<std::size_t> BackToFront(const Eigen::Vector3d& camera_position) const;

 private:
  // A plane with solid `a` behind it and solid `b` in front.
  struct Plane {
    std::size_t a = 0;
    std::size_t b = 0;
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
    double offset = 0.0;  // normal . p
  };

  std::vector<PosedSuperquadric> solids_;
  std::vector<Plane> planes_;
};

// A direction along which all of b lies beyond all of a: any such direction, or the best one if they overlap.
struct Separation {
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  // unit length, from a to b
  double gap = 0.0;     // along `direction`, map units; negative: they overlap by that much
  double middle = 0.0;  // direction . p of the plane halfway between a and b
};

// Tries the directions of the centres and axes, then a few steps of Gilbert's algorithm for the nearest
// points of two convex sets (1966). Both exponents must be at most 2, so that the solids are convex.
Separation Separate(const PosedSuperquadric& a, const PosedSuperquadric& b);

}  // namespace sqslam
