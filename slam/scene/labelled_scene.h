#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "slam/geometry/superquadric.h"
#include "slam/objects/object_class.h"
#include "slam/scene/scene_graph.h"

namespace sqslam {

inline constexpr double kTableTopShare = 0.1;  // thickness of a table's top, share of its height

// A solid with what its relations depend on: its extents, seen along z and in 48 horizontal directions.
struct PlacedSolid {
  static constexpr int kDirections = 48;

  PosedSuperquadric solid;
  const ObjectClass* traits = nullptr;
  double bottom = 0.0;  // z
  double top = 0.0;
  double bottom_sigma = 0.0;  // standard deviation of `bottom`: what it stands on may be so far away
  std::array<double, kDirections> extent{};  // from the centre to the outline

  PlacedSolid(const PosedSuperquadric& superquadric, const ObjectClass& class_traits);

  double Height() const { return top - bottom; }
  Eigen::Vector2d Centre() const { return solid.T_map_object.translation.head<2>(); }
  double HalfWidth() const;                     // geometric mean of the horizontal half sizes
  bool IsOver(const Eigen::Vector2d& p) const;  // true if p lies within the outline seen from above
  // Returns the share of the outline, shrunk by `shrunk` about its centre, that lies within `other`'s.
  double ShareOver(const PlacedSolid& other, double shrunk) const;
};

// Horizontal distance between the outlines of two solids; negative if they overlap. GapAlong: also the unit
// vector from the first to the second along which it is measured.
std::pair<double, Eigen::Vector2d> GapAlong(const PlacedSolid& a, const PlacedSolid& b);
double Gap(const PlacedSolid& a, const PlacedSolid& b);
double Gap(const PlacedSolid& a, const WallLine& wall);

// Floor, surfaces and walls: what solids may stand on or at, beside each other.
struct Room {
  double tolerance = 0.0;        // of heights, map units
  std::vector<double> surfaces;  // heights; they may extend further than their points
  std::optional<double> floor;   // height
  std::vector<WallLine> walls;   // x and y of their ends
};

// A relation without its probability. `other` counts the solids, then the surfaces, the floor (if any) and
// the walls.
struct LabelledRelation {
  RelationKind kind;
  int subject;
  int other;
  auto operator<=>(const LabelledRelation&) const = default;
};

// Returns the relations between solids of known size and place.
std::vector<LabelledRelation> LabelRelations(const std::vector<PlacedSolid>& solids, const Room& room);

}  // namespace sqslam
