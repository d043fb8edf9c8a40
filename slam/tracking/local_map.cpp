#include "slam/tracking/local_map.h"

#include <algorithm>
#include <set>

namespace sqslam {
namespace {

// The keyframe itself where it still exists, else the newest one.
KeyframeId ExistingKeyframe(const TrackingView& view, KeyframeId id) {
  return view.keyframes.contains(id) ? id : view.keyframes.rbegin()->first;
}

}  // namespace

LocalMap FindLocalMap(const TrackingView& view, const std::vector<PointId>& points, KeyframeId last_reference,
                      int max_keyframes) {
  std::vector<bool> seen(static_cast<std::size_t>(view.points.IdBound()), false);
  for (const PointId point : points) {
    if (view.Has(point)) {
      seen[static_cast<std::size_t>(point)] = true;
    }
  }
  const KeyframeId start = ExistingKeyframe(view, last_reference);
  std::set<KeyframeId> candidates{start};
  for (const KeyframeId near : view.keyframes.at(start).covisible) {
    candidates.insert(near);
    const auto& further = view.keyframes.at(near).covisible;
    candidates.insert(further.begin(), further.end());
  }
  std::vector<std::pair<int, KeyframeId>> ranked;
  for (const KeyframeId id : candidates) {
    int shared = 0;
    for (const PointId point : view.keyframes.at(id).points) {
      shared += point != kNoPoint && seen[static_cast<std::size_t>(point)] ? 1 : 0;
    }
    ranked.emplace_back(shared, id);
  }
  std::sort(ranked.begin(), ranked.end(), std::greater<>());
  LocalMap local;
  local.reference = ranked.front().first > 0 ? ranked.front().second : start;
  if (static_cast<int>(ranked.size()) > max_keyframes) {
    ranked.resize(static_cast<std::size_t>(max_keyframes));
  }
  std::vector<bool> added(static_cast<std::size_t>(view.points.IdBound()), false);
  for (const auto& [shared, id] : ranked) {
    for (const PointId point : view.keyframes.at(id).points) {
      if (point != kNoPoint && !added[static_cast<std::size_t>(point)]) {
        added[static_cast<std::size_t>(point)] = true;
        local.points.push_back(point);
      }
    }
  }
  return local;
}

}  // namespace sqslam
