#include "slam/scene/scene_graph.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "slam/scene/labelled_scene.h"
#include "slam/util/json_file.h"
#include "slam/util/to_vector.h"
#include "tests/io/temporary_folder.h"
#include "tests/scene/made_room.h"

namespace sqslam {
namespace {

using ::testing::IsSupersetOf;
using testing::MadeRoom;
using testing::MakeObject;
using ::testing::Not;
using ::testing::UnorderedElementsAre;

SceneGraph GraphOf(const MapSnapshot& map, const std::vector<WallLine>& walls = {}) {
  return MakeSceneGraph(map, ClassTable::Named("default"), walls);
}

std::vector<std::string> LikelyOf(const SceneGraph& graph, RelationKind kind) {
  std::vector<std::string> texts;
  for (const SceneRelation& relation : graph.relations) {
    if (relation.kind == kind && relation.IsLikely()) {
      texts.push_back(TitleOf(graph.nodes[static_cast<std::size_t>(relation.subject)]) + ", " +
                      TitleOf(graph.nodes[static_cast<std::size_t>(relation.other)]));
    }
  }
  return texts;
}

TEST(SceneGraph, FindsWhatStandsOnWhat) {
  EXPECT_THAT(LikelyOf(GraphOf(MadeRoom()), RelationKind::kOn),
              UnorderedElementsAre("dining table 1, floor", "cup 2, dining table 1", "cup 3, dining table 1",
                                   "oil 4, dining table 1", "book 5, dining table 1", "book 6, book 5",
                                   "bowl 7, dining table 1", "chair 9, floor", "chair 10, floor",
                                   "cushion 11, chair 10", "bookshelf 12, floor", "box 14, floor",
                                   "sports ball 15, floor", "skateboard 16, floor"));
}

TEST(SceneGraph, FindsOtherRelations) {
  const SceneGraph graph = GraphOf(MadeRoom());
  EXPECT_THAT(LikelyOf(graph, RelationKind::kIn),
              UnorderedElementsAre("apple 8, bowl 7", "book 13, bookshelf 12"));
  EXPECT_THAT(LikelyOf(graph, RelationKind::kUnder), UnorderedElementsAre("chair 9, dining table 1"));
  EXPECT_THAT(LikelyOf(graph, RelationKind::kLeansAgainst),
              UnorderedElementsAre("skateboard 16, bookshelf 12"));
  EXPECT_THAT(LikelyOf(graph, RelationKind::kNextTo), IsSupersetOf({"cup 2, oil 4", "bookshelf 12, box 14"}));
  EXPECT_THAT(LikelyOf(graph, RelationKind::kNextTo), Not(::testing::Contains("cup 2, cup 3")));
}

TEST(SceneGraph, FindsWalls) {
  const SceneGraph graph = GraphOf(MadeRoom(), {{{-3.0, 1.2}, {3.0, 1.2}}});
  EXPECT_THAT(LikelyOf(graph, RelationKind::kNextTo), ::testing::Contains("bookshelf 12, wall 0"));
  EXPECT_THAT(LikelyOf(graph, RelationKind::kNextTo), Not(::testing::Contains("cup 2, wall 0")));
}

TEST(SceneGraph, GivesHalfWhenCentreIsAsLikelyBesideTheEdge) {
  MapSnapshot map = MadeRoom();
  map.objects = {MakeObject(1, "box", {0.3, 0.3, 0.3}, 0.0, 0.0, 0.0),
                 MakeObject(2, "cup", {0.04, 0.04, 0.05}, 0.26, 0.0, 0.6)};
  // The weight lies inside or outside the edge: a shift of its centre by 4 cm decides.
  map.objects[1].superquadric.T_map_object.translation.x() = 0.3;
  map.objects[1].fit.covariance(0, 0) = 0.1 * 0.1;
  const SceneGraph graph = GraphOf(map);
  const auto on = std::ranges::find_if(graph.relations, [](const SceneRelation& r) {
    return r.kind == RelationKind::kOn && r.subject == 1 && r.other == 0;
  });
  ASSERT_NE(on, graph.relations.end());
  EXPECT_NEAR(on->probability, 0.5, 0.15);
}

TEST(SceneGraph, FindsTableThatIsNoObject) {
  MapSnapshot map = MadeRoom();
  map.objects.erase(map.objects.begin());
  for (int i = 0; i < 2000; ++i) {
    map.points.push_back({Eigen::Vector3f(-0.8F + 1.6F * static_cast<float>(i % 50) / 50.0F,
                                          -0.5F + 1.0F * static_cast<float>(i / 50) / 40.0F, 0.74F)});
  }
  const SceneGraph graph = GraphOf(map);
  EXPECT_THAT(LikelyOf(graph, RelationKind::kOn),
              IsSupersetOf({"cup 2, surface 0", "bowl 7, surface 0", "chair 9, floor"}));
}

TEST(SceneGraph, HasNoRelationsWithoutGravity) {
  MapSnapshot map = MadeRoom();
  map.gravity_known = false;
  EXPECT_TRUE(GraphOf(map).relations.empty());
  EXPECT_TRUE(GraphOf(MapSnapshot()).nodes.empty());
}

TEST(SceneGraph, RepeatsExactly) {
  const SceneGraph a = GraphOf(MadeRoom()), b = GraphOf(MadeRoom());
  ASSERT_EQ(a.relations.size(), b.relations.size());
  for (std::size_t i = 0; i < a.relations.size(); ++i) {
    EXPECT_EQ(a.relations[i].probability, b.relations[i].probability);
  }
}

TEST(SceneGraph, WritesNodesAndRelations) {
  const TemporaryFolder folder;
  const MapSnapshot map = MadeRoom();
  const SceneGraph graph = GraphOf(map);
  WriteSceneGraph(folder.Path() / "relations.json", graph, map);
  const auto json = ReadJsonFile(folder.Path() / "relations.json", "relations");
  EXPECT_EQ(json.at("unit"), "metres");
  ASSERT_EQ(json.at("nodes").size(), graph.nodes.size());
  EXPECT_EQ(json.at("nodes").back().at("kind"), "floor");
  ASSERT_EQ(json.at("relations").size(), graph.relations.size());
  EXPECT_EQ(json.at("relations").at(0).at("subject"), graph.relations[0].subject);
}

// Distances of the outlines of two boxes and of round things are known in closed form.
TEST(PlacedSolid, MeasuresGapsOfOutlines) {
  const ObjectClass traits;
  const auto at = [&](const Eigen::Vector3d& half, double e2, double x, double y) {
    return PlacedSolid({{half, 0.1, e2}, {Eigen::Quaterniond::Identity(), {x, y, 0.0}}}, traits);
  };
  EXPECT_NEAR(Gap(at({0.1, 0.2, 0.1}, 0.1, 0.0, 0.0), at({0.3, 0.1, 0.1}, 0.1, 1.0, 0.0)), 0.6, 1e-3);
  EXPECT_NEAR(Gap(at({0.1, 0.1, 0.1}, 1.0, 0.0, 0.0), at({0.2, 0.2, 0.1}, 1.0, 0.6, 0.8)), 0.7, 2e-3);
  EXPECT_LT(Gap(at({0.1, 0.1, 0.1}, 1.0, 0.0, 0.0), at({0.2, 0.2, 0.1}, 1.0, 0.2, 0.0)), 0.0);
  EXPECT_NEAR(Gap(at({0.1, 0.2, 0.1}, 0.1, 0.0, 0.0), WallLine{{-1.0, 0.5}, {1.0, 0.5}}), 0.3, 1e-3);
}

}  // namespace
}  // namespace sqslam
