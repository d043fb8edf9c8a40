#include "slam/scene/scene_graph.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include "slam/objects/support.h"
#include "slam/scene/labelled_scene.h"
#include "slam/scene/object_sampling.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

constexpr int kSamples = 64;
constexpr double kMinProbability = 0.05;

std::vector<PlacedSolid> PlaceObjects(const MapSnapshot& map, const ClassTable& classes) {
  return ToVector(map.objects, [&](const SnapshotObject& object) {
    return PlacedSolid(object.superquadric, classes.Of(object.label));
  });
}

// Returns true if most of a surface's points lie on tops of objects: the objects are what things stand on.
bool IsTopOfObjects(const SupportSurface& surface, const std::vector<PlacedSolid>& solids, double tolerance) {
  const std::vector<Eigen::Vector2d> points = PointsOn(surface, 2.0 * tolerance);
  const auto on_top = std::ranges::count_if(points, [&](const Eigen::Vector2d& p) {
    return std::ranges::any_of(solids, [&](const PlacedSolid& solid) {
      return std::abs(solid.top - surface.height) < 3.0 * tolerance && solid.IsOver(p);
    });
  });
  return 2 * static_cast<std::size_t>(on_top) > points.size();
}

// Returns the height of the floor: that of the map's points, or the mean foot of what stands on floors.
std::optional<double> FloorOf(const SupportSurfaces& surfaces, const std::vector<PlacedSolid>& solids) {
  double sum = 0.0;
  int feet = 0;
  for (const PlacedSolid& solid : solids) {
    if (solid.traits->on_floor) {
      sum += solid.bottom;
      ++feet;
    }
  }
  if (feet > 0) {
    const double foot = sum / feet;
    const auto& all = surfaces.All();
    const auto near = std::ranges::find_if(all, [&](const SupportSurface& surface) {
      return std::abs(surface.height - foot) < 3.0 * surfaces.Tolerance();
    });
    return near == all.end() ? foot : near->height;
  }
  return std::nullopt;
}

// Adds surfaces without points: heights at which at least two things stand that stand on nothing else.
void AddSharedHeights(const std::vector<PlacedSolid>& solids, Room& room) {
  std::vector<bool> placed(solids.size());
  for (const LabelledRelation& relation : LabelRelations(solids, room)) {
    if (relation.kind == RelationKind::kOn || relation.kind == RelationKind::kIn) {
      placed[static_cast<std::size_t>(relation.subject)] = true;
    }
  }
  std::vector<double> bottoms;
  for (std::size_t i = 0; i < solids.size(); ++i) {
    if (!placed[i]) {
      bottoms.push_back(solids[i].bottom);
    }
  }
  std::ranges::sort(bottoms);
  const double layer = 4.0 * room.tolerance;
  for (auto first = bottoms.begin(); first != bottoms.end();) {
    const auto last = std::upper_bound(first, bottoms.end(), *first + layer);
    if (last - first >= 2) {
      room.surfaces.push_back(*(first + (last - first) / 2));
    }
    first = last;
  }
}

Room RoomOf(const MapSnapshot& map, const std::vector<PlacedSolid>& solids,
            const std::vector<WallLine>& walls) {
  const SupportSurfaces found = SupportSurfaces::Find(PositionsOf(map), GravityOptions());
  Room room;
  room.tolerance = found.Tolerance();
  room.walls = walls;
  room.floor = FloorOf(found, solids);
  std::vector<SupportSurface> surfaces = found.All();
  std::erase_if(surfaces, [&](const SupportSurface& surface) {
    return (room.floor && surface.height < *room.floor + 2.0 * room.tolerance) ||
           IsTopOfObjects(surface, solids, room.tolerance);
  });
  room.surfaces = ToVector(surfaces, [](const SupportSurface& surface) { return surface.height; });
  AddSharedHeights(solids, room);
  return room;
}

// Standard deviation of the difference of an object's z and its half height.
double BottomSigma(const SnapshotObject& object) {
  constexpr int kZ = 2, kHalfHeight = 5;
  const auto& C = object.fit.covariance;
  return std::sqrt(std::max(0.0, C(kZ, kZ) + C(kHalfHeight, kHalfHeight) - 2.0 * C(kZ, kHalfHeight)));
}

std::vector<SceneNode> NodesOf(const MapSnapshot& map, const Room& room) {
  std::vector<SceneNode> nodes = ToVector(map.objects, [](const SnapshotObject& object) {
    return SceneNode{SceneNodeKind::kObject, object.id, ShownName(object)};
  });
  std::int32_t id = 0;
  for (const double height : room.surfaces) {
    nodes.push_back({SceneNodeKind::kSurface, id++, "surface", height});
  }
  if (room.floor) {
    nodes.push_back({SceneNodeKind::kFloor, 0, "floor", *room.floor});
  }
  id = 0;
  for (const WallLine& wall : room.walls) {
    nodes.push_back({SceneNodeKind::kWall, id++, "wall", 0.0, wall});
  }
  return nodes;
}

}  // namespace

SceneGraph MakeSceneGraph(const MapSnapshot& map, const ClassTable& classes,
                          const std::vector<WallLine>& walls) {
  const std::vector<PlacedSolid> solids = PlaceObjects(map, classes);
  const Room room = RoomOf(map, solids, walls);
  SceneGraph graph{NodesOf(map, room), {}};
  if (!map.gravity_known) {
    return graph;
  }
  std::map<LabelledRelation, int> counts;
  std::mt19937 random(1);
  for (int i = 0; i < kSamples; ++i) {
    std::vector<PlacedSolid> sample;
    for (const SnapshotObject& object : map.objects) {
      sample.emplace_back(SampleOf(object, random), classes.Of(object.label));
      sample.back().bottom_sigma = BottomSigma(object);
    }
    for (const LabelledRelation& relation : LabelRelations(sample, room)) {
      ++counts[relation];
    }
  }
  for (const auto& [relation, count] : counts) {
    const double probability = static_cast<double>(count) / kSamples;
    if (probability >= kMinProbability) {
      graph.relations.push_back({relation.kind, relation.subject, relation.other, probability});
    }
  }
  return graph;
}

std::string TitleOf(const SceneNode& node) {
  return node.kind == SceneNodeKind::kFloor ? node.label
                                            : fmt::format("{} {}", ReadableLabel(node.label), node.id);
}

}  // namespace sqslam
