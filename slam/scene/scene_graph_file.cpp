#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include "slam/io/map_frame.h"
#include "slam/io/point_cloud.h"
#include "slam/scene/scene_graph.h"
#include "slam/util/json_file.h"
#include "slam/util/thinned.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
namespace {

Json ToJson(const SceneNode& node) {
  Json json = {{"kind", NameOf(node.kind)}, {"id", node.id}, {"label", node.label}};
  if (node.kind == SceneNodeKind::kSurface || node.kind == SceneNodeKind::kFloor) {
    json["height"] = node.height;
  } else if (node.kind == SceneNodeKind::kWall) {
    json["from"] = node.wall.from;
    json["to"] = node.wall.to;
  }
  return json;
}

}  // namespace

void WriteSceneGraph(const fs::path& path, const SceneGraph& graph, const MapSnapshot& map) {
  const MapFrame frame = FrameOf(map);
  Json root = {{"format", "sqslam-relations"},
               {"version", 1},
               {"unit", frame.Unit()},
               {"frame", "map"},
               {"gravity_aligned", frame.upright}};
  root["nodes"] = ToVector(graph.nodes, [](const SceneNode& node) { return ToJson(node); });
  root["relations"] = ToVector(graph.relations, [](const SceneRelation& relation) {
    return Json{{"relation", NameOf(relation.kind)},
                {"subject", relation.subject},
                {"object", relation.other},
                {"probability", relation.probability}};
  });
  WriteJsonFile(path, root);
}

SceneGraph SceneGraphOf(const MapSnapshot& map, const fs::path& folder) {
  constexpr std::size_t kWallPoints = 200'000;
  const fs::path cloud = folder / "dense.ply";
  std::vector<WallLine> walls;
  if (map.gravity_known && fs::exists(cloud)) {
    walls = FindWallLines(Thinned(ReadPointCloud(cloud).points, kWallPoints));
  }
  return MakeSceneGraph(map, ClassTable::Named("default"), walls);
}

}  // namespace sqslam
