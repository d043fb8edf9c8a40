#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "slam/objects/object_class.h"
#include "slam/scene/scene_graph.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

// An object that answers a question, with the probability that it does.
struct QueryAnswer {
  int object = 0;  // index in the map
  double probability = 0.0;
};

// Answers a question about the objects of a map, such as "certain cups on the table":
//
//   question  := [things] { [not] condition }          all conditions must hold; all objects by default
//   condition := RELATION things                       on, in, under, above, next to, leans against
//              | within LENGTH of things               between surfaces: 0.5 m, 30 cm; 2 units
//              | nearest to things                     (or farthest from)
//              | left of things seen from FRAME        also right of, in front of, behind
//   things    := { [COUNT] largest | smallest | tallest | highest | lowest | certain | uncertain }
//                CLASS { and CLASS } | CLASS ID | objects | floor | walls
//
// A class is a label, a name or a synonym (ObjectClass), in the singular or plural. If the map has no object
// of a class with legs (table, desk), its surfaces count as one. Articles and words such as "which", "are"
// and "show" mean nothing. Answers are those more likely than not, the best first; with a superlative, only
// those it chooses. Throws UsageError for a word that is not known, naming the nearest one that is, and for a
// sentence that is not complete.
std::vector<QueryAnswer> AnswerQuery(const std::string& question, const MapSnapshot& map,
                                     const SceneGraph& graph, const ClassTable& classes);

// Returns the distances between the surfaces of each object and each node of the graph, as questions measure
// them: horizontally and in height.
std::vector<std::vector<double>> DistancesToNodes(const MapSnapshot& map, const SceneGraph& graph,
                                                  const ClassTable& classes);

}  // namespace sqslam
