#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "slam/objects/object_class.h"
#include "slam/scene/wall_lines.h"
#include "slam/snapshot/snapshot.h"
#include "slam/util/enum_names.h"

namespace sqslam {

enum class SceneNodeKind { kObject, kSurface, kFloor, kWall };
constexpr auto EnumNames(SceneNodeKind) { return std::array{"object", "surface", "floor", "wall"}; }

// An object of a map, or a part of the room that objects stand on or at.
struct SceneNode {
  SceneNodeKind kind = SceneNodeKind::kObject;
  std::int32_t id = 0;  // of an object; surfaces and walls count from 0
  std::string label;    // name or label of an object; otherwise the kind
  double height = 0.0;  // z of a surface or the floor, map units
  WallLine wall = {};   // of a wall: x and y of its ends, map frame
};

// Relation of a subject to another node:
//   on             the subject's weight rests on the other's top, or on the seat of a chair
//   in             it stands within the other's hull: a book in a shelf, an apple in a bowl
//   under          a part of its outline, seen from above, lies below the other
//   next to        both stand at one height, no farther apart than their mean half width; symmetric, each
//                  pair once
//   leans against  it is too thin to stand well, and touches the side of the other
enum class RelationKind { kOn, kIn, kUnder, kNextTo, kLeansAgainst };
constexpr auto EnumNames(RelationKind) { return std::array{"on", "in", "under", "next to", "leans against"}; }

struct SceneRelation {
  RelationKind kind = RelationKind::kOn;
  int subject = 0;  // indices of nodes
  int other = 0;
  double probability = 0.0;

  // Returns true if the relation is more likely than not.
  bool IsLikely() const { return probability >= 0.5; }
};

struct SceneGraph {
  std::vector<SceneNode> nodes;  // objects in the order of the map, then the room
  std::vector<SceneRelation> relations;
};

// Finds the relations between the objects of a map with z up, its horizontal surfaces (from its points), and
// `walls` (x and y in the map frame). A probability is the share of samples of all objects, drawn from their
// covariances, in which the relation holds; as nothing floats, a bottom counts as standing on what lies
// within three standard deviations of it; relations below 5 % are left out. Deterministic. Returns a graph
// without relations if the map is not aligned with gravity.
SceneGraph MakeSceneGraph(const MapSnapshot& map, const ClassTable& classes,
                          const std::vector<WallLine>& walls = {});

// Writes relations.json: unit, frame, nodes, and relations whose subject and object are indices of nodes.
void WriteSceneGraph(const std::filesystem::path& path, const SceneGraph& graph, const MapSnapshot& map);

// Returns the scene graph of the last state of a map, with the walls of dense.ply in `folder` if there is
// one.
SceneGraph SceneGraphOf(const MapSnapshot& map, const std::filesystem::path& folder);

// Returns "cup 3", "floor" or "wall 1".
std::string TitleOf(const SceneNode& node);

}  // namespace sqslam
