#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "slam/objects/object_class.h"
#include "slam/scene/scene_graph.h"
#include "slam/snapshot/snapshot.h"
#include "slam/util/enum_names.h"

namespace sqslam::question {

// Parts that the words of a question play, apart from the names of classes.
enum class Role { kFiller, kJoin, kNot, kRelation, kWithin, kSide, kSuperlative, kCertainty, kThings, kRoom };
constexpr auto EnumNames(Role) {
  return std::array{"filler", "join",        "not",       "relation", "within",
                    "side",   "superlative", "certainty", "things",   "room"};
}

enum Connection : int { kOn, kIn, kUnder, kAbove, kNextTo, kLeans };
enum Side : int { kLeft, kRight, kInFront, kBehind };
enum Superlative : int { kLargest, kSmallest, kTallest, kHighest, kLowest, kNearest, kFarthest };

struct Term {
  Role role;
  int value = 0;  // a relation, side, superlative, certainty or kind of node
};

// Returns what words mean. A phrase of several words is written with blanks.
const std::map<std::string, Term>& Terms();

struct Choice {
  Superlative by = kLargest;
  int count = 1;
};

struct Things {
  std::vector<bool> members;  // of the graph's nodes
  std::optional<Choice> choice;
};

struct Condition {
  Role role = Role::kRelation;  // kRelation, kWithin, kSide or kSuperlative
  int value = 0;
  bool negated = false;
  Things things;
  double length = 0.0;     // of kWithin, map units
  std::int64_t frame = 0;  // of kSide
};

struct Question {
  Things things;
  std::vector<Condition> conditions;
};

// Reads a question (grammar: AnswerQuery) about the map and its graph. Throws UsageError for a word that is
// not known, naming the nearest one that is, and for a sentence that is not complete.
Question Parse(const std::string& question, const MapSnapshot& map, const SceneGraph& graph,
               const ClassTable& classes);

}  // namespace sqslam::question
