#include "slam/mapping/culling.h"

#include <algorithm>

namespace sqslam {

int CullPoints(Map& map, std::set<PointId>& young, KeyframeId newest, const CullingOptions& options) {
  constexpr KeyframeId kTrial = 2;   // keyframes after which a point must be seen often enough
  constexpr KeyframeId kPassed = 3;  // keyframes after which it is no longer young
  int removed = 0;
  for (auto it = young.begin(); it != young.end();) {
    if (!map.IsAlive(*it)) {
      it = young.erase(it);
      continue;
    }
    const MapPoint& point = map.Point(*it);
    const KeyframeId age = newest - point.first_keyframe;
    const bool poor =
        point.FoundRatio() < options.min_found_ratio ||
        (age >= kTrial && static_cast<int>(point.observations.size()) < options.min_observations);
    if (poor) {
      map.RemovePoint(*it);
      ++removed;
    }
    it = poor || age >= kPassed ? young.erase(it) : std::next(it);
  }
  return removed;
}

namespace {

bool IsRedundant(const Map& map, const Keyframe& keyframe, const CullingOptions& options) {
  int points = 0;
  int redundant = 0;
  for (std::size_t i = 0; i < keyframe.points.size(); ++i) {
    if (keyframe.points[i] == kNoPoint) {
      continue;
    }
    ++points;
    const int octave = keyframe.features->keypoints[i].octave;
    int others = 0;
    for (const Observation& o : map.Point(keyframe.points[i]).observations) {
      if (o.keyframe != keyframe.id &&
          map.At(o.keyframe).features->keypoints[static_cast<std::size_t>(o.keypoint)].octave <= octave + 1) {
        ++others;
      }
    }
    redundant += others >= options.redundant_observations ? 1 : 0;
  }
  return redundant > options.redundant_share * points;
}

}  // namespace

std::vector<KeyframeId> CullKeyframes(Map& map, KeyframeId center, const CullingOptions& options,
                                      const LoopEdges& loop_edges) {
  std::set<KeyframeId> kept{center};
  for (const auto& [i, j] : loop_edges) {
    kept.insert({i, j});
  }
  const KeyframeId second =
      std::next(map.Keyframes().begin())->first;  // the first two hold a young map's scale
  std::vector<KeyframeId> culled;
  for (const KeyframeId id : map.At(center).BestCovisible(static_cast<int>(map.Keyframes().size()))) {
    if (id > second && !kept.contains(id) && IsRedundant(map, map.At(id), options)) {
      map.RemoveKeyframe(id);
      culled.push_back(id);
    }
  }
  return culled;
}

}  // namespace sqslam
