#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "slam/geometry/superquadric.h"

namespace sqslam {

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
