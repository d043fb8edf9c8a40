#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "slam/geometry/superquadric.h"

namespace sqslam {

// The drawing order of translucent superquadrics, such that nearer ones cover farther ones. Of two convex
// solids separated by a plane, the one on the camera's side is drawn later. Interpenetrating solids have no
// order and must be drawn together. The order does not depend on the numbering of the solids. Of thousands of
// solids, whose pairs would take all time and memory, only the distances count.
class SolidOrder {
 public:
  SolidOrder() = default;

  // Finds the separating planes, which are the same for all views.
  explicit SolidOrder(std::vector<PosedSuperquadric> solids);

  // Returns entries to draw, farthest first. Each is the index of a single solid or the indices of
  // interpenetrating solids.
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

// The functions below treat superquadrics as convex solids (both exponents at most 2).

// A direction along which all of b lies beyond all of a: any such direction, or the best one if they overlap.
struct Separation {
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  // unit length, from a to b
  double gap = 0.0;     // along `direction`, map units; negative: they overlap by that much
  double middle = 0.0;  // direction . p of the plane halfway between a and b
};

// Tries the directions of the centres and axes, then a few steps of Gilbert's algorithm for the nearest
// points of two convex sets (1966).
Separation Separate(const PosedSuperquadric& a, const PosedSuperquadric& b);

// Returns groups of two or more interpenetrating solids (ascending indices).
std::vector<std::vector<int>> InterpenetratingGroups(std::span<const PosedSuperquadric> solids);

}  // namespace sqslam
