#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "slam/geometry/superquadric.h"

namespace sqslam {

// The order in which to draw translucent superquadrics so that nearer ones cover farther ones. Two convex
// solids that a plane separates can always be ordered: the one on the camera's side of the plane is drawn
// later. Solids that reach into one another have no order and are to be drawn together. The order depends on
// the solids alone, not on how they are numbered.
class SolidOrder {
 public:
  SolidOrder() = default;

  // Finds the planes, which hold for every view.
  explicit SolidOrder(std::vector<PosedSuperquadric> solids);

  // Farthest first; each entry is what is drawn at one go: the index of a single solid, or the indices of
  // solids that reach into one another.
  std::vector<std::vector<int>> BackToFront(const Eigen::Vector3d& camera_position) const;

 private:
  // A plane with the solids of entry `a` behind it and those of entry `b` in front.
  struct Plane {
    int a = 0;
    int b = 0;
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
    double offset = 0.0;  // normal . p
  };

  std::vector<PosedSuperquadric> solids_;
  std::vector<std::vector<int>> entries_;
  std::vector<Plane> planes_;
};

// Superquadrics as convex solids (both exponents at most 2).

// A direction along which all of b lies beyond all of a: any such, or the best there is where they overlap.
struct Separation {
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  // unit length, from a to b
  double gap = 0.0;     // along it, map units; negative: they overlap by that much in this direction
  double middle = 0.0;  // direction . p of the plane halfway between the two
};

// By the directions of centres and axes, then by Gilbert's algorithm for the nearest points of two convex
// sets (1966), `rounds` steps at most.
Separation Separate(const PosedSuperquadric& a, const PosedSuperquadric& b, int rounds = 40);

// Sets of solids that reach into one another, each with at least two members (indices, ascending); solids
// that stand free are in none. `slack`: solids are shrunk by this share, so that mere contact does not count.
std::vector<std::vector<int>> InterpenetratingGroups(std::span<const PosedSuperquadric> solids,
                                                     double slack = 0.03);

}  // namespace sqslam
