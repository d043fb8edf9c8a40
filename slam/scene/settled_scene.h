#pragma once

#include <optional>
#include <vector>

#include "slam/geometry/superquadric.h"
#include "slam/objects/object_class.h"
#include "slam/scene/scene_graph.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

// An object as a physical body: what it stands on, and where without penetrating anything.
struct SettledObject {
  PosedSuperquadric solid;  // map frame
  int place = -1;           // node of the graph that it stands on or in; -1: unknown
  bool inside = false;      // it stands in that node
  bool fixed = false;       // furniture, things in something, and things that stand on nothing known
  double shift = 0.0;       // from the mapped place, map units
  double sigmas = 0.0;      // the shift in standard deviations (Mahalanobis distance)
};

struct SettledScene {
  std::vector<SettledObject> objects;  // in the order of the map
};

// The solid part of an object, between two heights: of a class with legs the top, of a seat the part below
// what lies on it.
struct SolidSpan {
  double bottom = 0.0;
  double top = 0.0;
};
SolidSpan SolidSpanOf(const SettledScene& scene, int object, const ObjectClass& traits);

// Moves objects as little as possible, in units of their covariances, until each stands exactly on its place
// and the outlines of bodies at one height are `clearance` (map units) apart: each pair that violates this is
// moved by the least shift in the sense of its covariances, in rounds, until no pair is left. A covariance of
// zero counts as 1 mm per metre of size.
SettledScene Settle(const MapSnapshot& map, const SceneGraph& graph, const ClassTable& classes,
                    double clearance);

}  // namespace sqslam
