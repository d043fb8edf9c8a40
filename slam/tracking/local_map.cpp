#include "slam/tracking/local_map.h"

#include <algorithm>
#include <functional>
#include <ranges>
#include <set>
#include <utility>

namespace sqslam {

const ViewKeyframe& ExistingKeyframe(const TrackingView& view, KeyframeId id) {
  const auto it = view.keyframes.find(id);
  return it != view.keyframes.end() ? it->second : view.keyframes.rbegin()->second;
}

LocalMap FindLocalMap(const TrackingView& view, const std::vector<PointId>& points, KeyframeId last_reference,
                      int max_keyframes) {
  std::vector<bool> seen(view.points.IdBound(), false);
  for (const PointId point : points) {
    if (view.Has(point)) {
      seen[point] = true;
    }
  }
  const ViewKeyframe& start = ExistingKeyframe(view, last_reference);
  std::set<KeyframeId> candidates{start.id};
  for (const KeyframeId near : start.covisible) {
    candidates.insert(near);
    const auto& further = view.keyframes.at(near).covisible;
    candidates.insert(further.begin(), further.end());
  }
  std::vector<std::pair<int, KeyframeId>> ranked;
  for (const KeyframeId id : candidates) {
    int shared = 0;
    for (const PointId point : view.keyframes.at(id).points) {
      shared += point != kNoPoint && seen[point] ? 1 : 0;
    }
    ranked.emplace_back(shared, id);
  }
  std::ranges::sort(ranked, std::greater<>());
  LocalMap local;
  local.reference = ranked.front().first > 0 ? ranked.front().second : start.id;
  std::vector<bool> added(view.points.IdBound(), false);
  for (const auto& [shared, id] : ranked | std::views::take(max_keyframes)) {
    for (const PointId point : view.keyframes.at(id).points) {
      if (point != kNoPoint && !added[point]) {
        added[point] = true;
        local.points.push_back(point);
      }
    }
  }
  return local;
}

}  // namespace sqslam
