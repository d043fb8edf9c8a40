#pragma once

#include <Eigen/Core>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "render/scene/style.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

// Returns the colour of an object in one picture.
using ObjectColor = std::function<Eigen::Vector3d(const SnapshotObject& object)>;

// Returns the solids that stand for an object in a picture, map frame: its parts or its hull.
std::vector<PosedSuperquadric> DrawnSolids(const SnapshotObject& object, const SceneStyle::Objects& style);

// Returns how an object is drawn: kSolid, kGlass or kOutline. `dense`: among a dense cloud or mesh.
// Automatic: glass there, and everywhere for the hulls of hollow classes such as tables and chairs (`hollow`
// in configs/classes.yaml), which are mostly air and would hide what stands in them; solid for all others.
ObjectLook LookOf(const SnapshotObject& object, const SceneStyle::Objects& style, bool dense);

// Returns true if an object hides what is behind it: a solid that is not drawn as thin lines because it is
// uncertain. `see_through`: all objects are, and the nearest one counts.
bool HidesOthers(const SnapshotObject& object, const SceneStyle::Objects& style, bool see_through);

// Returns the map with the chosen objects (indices) as reliable ones, all others as faint outlines without
// names.
MapSnapshot Highlighted(MapSnapshot map, const std::set<int>& chosen);

}  // namespace sqslam
