#include "slam/scene/query.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iterator>
#include <map>
#include <optional>

#include "slam/scene/labelled_scene.h"
#include "slam/scene/question.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

using enum question::Connection;
using enum question::Side;
using enum question::Superlative;
using question::Condition;
using question::Question;
using question::Role;
using question::Superlative;
using question::Things;

// Finds the objects that a parsed question means.
class Evaluator {
 public:
  Evaluator(const MapSnapshot& map, const SceneGraph& graph, const ClassTable& classes)
      : map_(map), graph_(graph) {
    for (const SnapshotObject& object : map.objects) {
      solids_.emplace_back(object.superquadric, classes.Of(object.label));
    }
    for (const SceneRelation& relation : graph.relations) {
      probability_[{relation.kind, relation.subject, relation.other}] = relation.probability;
    }
  }

  std::vector<QueryAnswer> Answer(const Question& question) const {
    std::vector<QueryAnswer> answers;
    for (int a = 0; a < static_cast<int>(map_.objects.size()); ++a) {
      double probability = question.things.members[static_cast<std::size_t>(a)] ? 1.0 : 0.0;
      for (const Condition& condition : question.conditions) {
        if (condition.role != Role::kSuperlative && probability > 0.0) {
          const double holds = Holds(a, condition);
          probability *= condition.negated ? 1.0 - holds : holds;
        }
      }
      if (probability >= 0.5) {
        answers.push_back({a, probability});
      }
    }
    for (const Condition& condition : question.conditions) {
      if (condition.role == Role::kSuperlative) {
        Keep(answers, 1, [&](int a) {
          const double distance = DistanceTo(a, Members(condition.things));
          return condition.value == kNearest ? distance : -distance;
        });
      }
    }
    if (question.things.choice) {
      Keep(answers, question.things.choice->count,
           [&](int a) { return RankOf(a, question.things.choice->by); });
    } else {
      std::ranges::stable_sort(answers, std::greater(), &QueryAnswer::probability);
    }
    return answers;
  }

  // Returns the distance between the surfaces of two solids: horizontally and in height.
  double Distance(int a, int node) const {
    const PlacedSolid& first = Solid(a);
    if (!IsObject(node)) {
      const SceneNode& room = graph_.nodes[static_cast<std::size_t>(node)];
      return std::max(0.0,
                      room.kind == SceneNodeKind::kWall ? Gap(first, room.wall) : first.bottom - room.height);
    }
    const PlacedSolid& second = Solid(node);
    const double vertical = std::max({0.0, first.bottom - second.top, second.bottom - first.top});
    return std::hypot(std::max(0.0, Gap(first, second)), vertical);
  }

 private:
  const PlacedSolid& Solid(int i) const { return solids_[static_cast<std::size_t>(i)]; }
  bool IsObject(int node) const { return node < static_cast<int>(solids_.size()); }

  double Probability(RelationKind kind, int a, int b) const {
    const auto it = probability_.find({kind, a, b});
    return it == probability_.end() ? 0.0 : it->second;
  }

  double Connected(int relation, int a, int b) const {
    switch (relation) {
      case kOn:
        return Probability(RelationKind::kOn, a, b);
      case kIn:
        return Probability(RelationKind::kIn, a, b);
      case kUnder:
        return std::max(Probability(RelationKind::kUnder, a, b), Probability(RelationKind::kOn, b, a));
      case kAbove:
        return Connected(kUnder, b, a);
      case kNextTo:
        return std::max(Probability(RelationKind::kNextTo, a, b), Probability(RelationKind::kNextTo, b, a));
      default:
        return Probability(RelationKind::kLeansAgainst, a, b);
    }
  }

  // Smaller comes first.
  double RankOf(int a, Superlative by) const {
    const PlacedSolid& solid = Solid(a);
    switch (by) {
      case kLargest:
        return -solid.solid.shape.Volume();
      case kSmallest:
        return solid.solid.shape.Volume();
      case kTallest:
        return -solid.Height();
      case kHighest:
        return -solid.top;
      case kLowest:
        return solid.bottom;
      default:
        throw UsageError("question: expected 'to' or 'from' and a class after 'nearest' and 'farthest'");
    }
  }

  static void Keep(std::vector<QueryAnswer>& answers, int count, const std::function<double(int)>& rank) {
    std::ranges::stable_sort(answers, {}, [&](const QueryAnswer& answer) { return rank(answer.object); });
    answers.resize(std::min(answers.size(), static_cast<std::size_t>(std::max(count, 1))));
  }

  // Returns the nodes that are meant, after a superlative's choice among objects.
  std::vector<int> Members(const Things& things) const {
    std::vector<QueryAnswer> members;
    for (int i = 0; i < static_cast<int>(things.members.size()); ++i) {
      if (things.members[static_cast<std::size_t>(i)]) {
        members.push_back({i, 1.0});
      }
    }
    if (things.choice) {
      std::erase_if(members, [this](const QueryAnswer& member) { return !IsObject(member.object); });
      Keep(members, things.choice->count, [&](int a) { return RankOf(a, things.choice->by); });
    }
    return ToVector(members, &QueryAnswer::object);
  }

  double DistanceTo(int a, const std::vector<int>& nodes) const {
    double nearest = 1e300;
    for (const int node : nodes) {
      if (node != a) {
        nearest = std::min(nearest, Distance(a, node));
      }
    }
    return nearest;
  }

  double Holds(int a, const Condition& condition) const {
    const std::vector<int> nodes = Members(condition.things);
    if (condition.role == Role::kWithin) {
      return DistanceTo(a, nodes) <= condition.length ? 1.0 : 0.0;
    }
    double best = 0.0;
    for (const int node : nodes) {
      if (node == a) {
        continue;
      }
      best = std::max(best, condition.role == Role::kSide ? IsAtSide(a, node, condition)
                                                          : Connected(condition.value, a, node));
    }
    return best;
  }

  // Compares the centres in the camera of the keyframe nearest to the frame.
  double IsAtSide(int a, int node, const Condition& condition) const {
    ThrowIf<UsageError>(map_.keyframes.empty(), "question: the map has no keyframe to see the objects from");
    if (!IsObject(node)) {
      return 0.0;
    }
    const Rigid3d& pose = std::ranges::min_element(map_.keyframes, {}, [&](const SnapshotKeyframe& keyframe) {
                            return std::abs(keyframe.frame_index - condition.frame);
                          })->T_map_camera;
    const Eigen::Vector3d p = pose.Inverse() * Solid(a).solid.T_map_object.translation;
    const Eigen::Vector3d q = pose.Inverse() * Solid(node).solid.T_map_object.translation;
    if (p.z() <= 0.0 || q.z() <= 0.0) {
      return 0.0;
    }
    const double right = p.x() / p.z() - q.x() / q.z();
    const std::array<double, 4> amount = {-right, right, q.z() - p.z(), p.z() - q.z()};
    return amount[static_cast<std::size_t>(condition.value)] > 0.0 ? 1.0 : 0.0;
  }

  const MapSnapshot& map_;
  const SceneGraph& graph_;
  std::vector<PlacedSolid> solids_;
  std::map<LabelledRelation, double> probability_;
};

}  // namespace

std::vector<QueryAnswer> AnswerQuery(const std::string& question, const MapSnapshot& map,
                                     const SceneGraph& graph, const ClassTable& classes) {
  return Evaluator(map, graph, classes).Answer(question::Parse(question, map, graph, classes));
}

std::vector<std::vector<double>> DistancesToNodes(const MapSnapshot& map, const SceneGraph& graph,
                                                  const ClassTable& classes) {
  const Evaluator evaluator(map, graph, classes);
  std::vector<std::vector<double>> distances(map.objects.size(), std::vector<double>(graph.nodes.size()));
  for (std::size_t a = 0; a < distances.size(); ++a) {
    for (std::size_t b = 0; b < graph.nodes.size(); ++b) {
      distances[a][b] = evaluator.Distance(static_cast<int>(a), static_cast<int>(b));
    }
  }
  return distances;
}

}  // namespace sqslam
