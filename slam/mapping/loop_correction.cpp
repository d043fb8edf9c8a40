#include "slam/mapping/loop_correction.h"

#include <algorithm>
#include <map>
#include <ranges>
#include <vector>

#include "slam/estimation/pose_graph.h"

namespace sqslam {
namespace {

using Similarities = std::map<KeyframeId, Sim3d>;  // S_camera_map by keyframe

std::vector<KeyframeId> Group(const Map& map, KeyframeId current) {
  std::vector<KeyframeId> group{current};
  std::ranges::copy(std::views::keys(map.At(current).covisibility), std::back_inserter(group));
  std::ranges::sort(group);
  return group;
}

Similarities CurrentSimilarities(const Map& map) {
  Similarities similarities;
  for (const auto& [id, keyframe] : map.Keyframes()) {
    similarities[id] = Sim3d::FromRigid(keyframe.T_camera_map);
  }
  return similarities;
}

// The keyframe that each point moves with.
using Carriers = std::map<PointId, KeyframeId>;

// Writes the new poses and moves each point with its carrier.
void MoveMap(Map& map, const Similarities& before, const Similarities& after, const Carriers& carriers) {
  for (const auto& [id, carrier] : carriers) {
    MapPoint& point = map.Point(id);
    point.p_map = after.at(carrier).Inverse() * (before.at(carrier) * point.p_map);
  }
  for (const auto& [id, S_camera_map] : after) {
    map.At(id).T_camera_map = S_camera_map.RigidPose();
    map.At(id).scale /= S_camera_map.scale;
  }
  for (const MapPoint& point : map.Points()) {
    map.UpdateNormalAndRange(point.id);
  }
}

// Maps each point that the group observes to the oldest of its observers in the group. Points in `known` keep
// their carrier.
Carriers FindCarriers(const Map& map, const Similarities& group, const Carriers& known) {
  Carriers carriers;
  for (const MapPoint& point : map.Points()) {
    if (const auto it = known.find(point.id); it != known.end()) {
      carriers[point.id] = it->second;
      continue;
    }
    KeyframeId first = kNoKeyframe;
    for (const Observation& o : point.observations) {
      if (group.contains(o.keyframe) && (first == kNoKeyframe || o.keyframe < first)) {
        first = o.keyframe;
      }
    }
    if (first != kNoKeyframe) {
      carriers[point.id] = first;
    }
  }
  return carriers;
}

// Measures new links between corrected poses, and all other edges between the poses before.
std::vector<PoseGraphEdge> EssentialGraph(const Map& map, const Similarities& before,
                                          const Similarities& corrected, const LoopEdges& new_links,
                                          const LoopEdges& loop_edges) {
  constexpr int kStrongCovisibility = 100;  // shared map points from which two keyframes get an edge
  LoopEdges seen;
  std::vector<PoseGraphEdge> edges;
  const auto add = [&](const Similarities& measured, KeyframeId i, KeyframeId j) {
    if (measured.contains(i) && measured.contains(j) && seen.insert(std::minmax(i, j)).second) {
      edges.push_back({i, j, measured.at(j) * measured.at(i).Inverse(), 1.0});
    }
  };
  for (const auto& [i, j] : new_links) {
    add(corrected, i, j);
  }
  for (const auto& [id, keyframe] : map.Keyframes()) {
    add(before, id, keyframe.parent);
    for (const auto& [other, weight] : keyframe.covisibility) {
      if (weight >= kStrongCovisibility) {
        add(before, id, other);
      }
    }
  }
  for (const auto& [i, j] : loop_edges) {
    add(before, i, j);
  }
  return edges;
}

// The loop edge, and covisibility between the two sides that arose when their points were fused.
LoopEdges NewLinks(const Map& map, const Similarities& group,
                   const std::map<KeyframeId, std::map<KeyframeId, int>>& covisibility_before,
                   const LoopCandidate& loop) {
  LoopEdges links{std::minmax(loop.current, loop.known)};
  for (const auto& [id, S] : group) {
    for (const auto& [other, weight] : map.At(id).covisibility) {
      if (!group.contains(other) && !covisibility_before.at(id).contains(other)) {
        links.insert(std::minmax(id, other));
      }
    }
  }
  return links;
}

}  // namespace

Sim3d SimilarityOfMaps(const Map& current_map, const Map& known_map, const LoopCandidate& loop) {
  const Sim3d S_known_map = Sim3d::FromRigid(known_map.At(loop.known).T_camera_map);
  const Sim3d S_current_map = Sim3d::FromRigid(current_map.At(loop.current).T_camera_map);
  return S_known_map.Inverse() * loop.S_current_known.Inverse() * S_current_map;
}

void FuseLoop(Map& map, const Camera& camera, const LoopCandidate& loop) {
  const std::vector<KeyframeId> group = Group(map, loop.current);
  for (const auto& [point, keypoint] : loop.confirmed) {
    if (!map.IsAlive(point)) {
      continue;
    }
    const PointId present = map.At(loop.current).points[keypoint];
    if (present != kNoPoint) {
      map.Fuse(present, point);
    } else if (!map.Point(point).IsSeenBy(loop.current)) {
      map.AddObservation(point, loop.current, keypoint);
    }
  }
  ProjectionSearch search;
  search.radius = kLoopSearchRadius / 2.0;
  std::set<PointId> known;
  for (const PointId point : loop.known_points) {
    if (map.IsAlive(point)) {
      known.insert(point);
    }
  }
  for (const KeyframeId id : group) {
    FuseInto(map, camera, known, id, search);
  }
  for (const PointId point : known) {
    if (map.IsAlive(point)) {
      map.UpdateAppearance(point);
    }
  }
  for (const KeyframeId id : group) {
    map.UpdateCovisibility(id);
  }
}

void CorrectLoop(Map& map, const Camera& camera, const LoopCandidate& loop, LoopEdges& edges) {
  for (const KeyframeId id : Group(map, loop.current)) {
    map.UpdateCovisibility(id);
  }
  const Similarities before = CurrentSimilarities(map);
  std::map<KeyframeId, std::map<KeyframeId, int>> covisibility_before;
  Similarities group;
  // The current camera as seen from the known side of the loop; its neighbours keep their relative poses.
  const Sim3d S_current_map = loop.S_current_known * before.at(loop.known);
  for (const KeyframeId id : Group(map, loop.current)) {
    group[id] = before.at(id) * before.at(loop.current).Inverse() * S_current_map;
    covisibility_before[id] = map.At(id).covisibility;
  }
  const Carriers moved = FindCarriers(map, group, {});
  MoveMap(map, before, group, moved);
  FuseLoop(map, camera, loop);

  Similarities corrected = group;
  corrected.insert(before.begin(), before.end());
  const LoopEdges new_links = NewLinks(map, group, covisibility_before, loop);
  std::vector<PoseGraphNode> nodes;
  for (const auto& [id, S_camera_map] : corrected) {
    nodes.push_back({id, S_camera_map, id == loop.known});
  }
  edges.insert(std::minmax(loop.current, loop.known));
  OptimizePoseGraph(nodes, EssentialGraph(map, before, corrected, new_links, edges));
  // The group was moved above: start from its present poses.
  Similarities from;
  Similarities to;
  for (const PoseGraphNode& node : nodes) {
    from[node.id] = Sim3d::FromRigid(map.At(node.id).T_camera_map);
    const double written = group.contains(node.id) ? group.at(node.id).scale : 1.0;
    to[node.id] = {node.S_camera_map.scale / written, node.S_camera_map.rotation,
                   node.S_camera_map.translation / written};
  }
  MoveMap(map, from, to, FindCarriers(map, from, moved));
}

}  // namespace sqslam
