#include "slam/map/renumber.h"

#include <map>
#include <vector>

#include "slam/util/raise_keys.h"

namespace sqslam {
namespace {

void RenumberKeyframes(const IdShift& shift, std::map<KeyframeId, Keyframe>& keyframes) {
  RaiseKeys(keyframes, shift.keyframe);
  for (auto& [id, keyframe] : keyframes) {
    keyframe.id += shift.keyframe;
    keyframe.parent += keyframe.parent == kNoKeyframe ? 0 : shift.keyframe;
    keyframe.frame_index += shift.frame;
    keyframe.timestamp += shift.time;
    RaiseKeys(keyframe.covisibility, shift.keyframe);
    for (PointId& point : keyframe.points) {
      point += point == kNoPoint ? 0 : shift.point;
    }
  }
}

void RenumberRemoved(const IdShift& shift, RemovedKeyframes& removed) {
  RemovedKeyframes::VisitState(removed, [&](std::map<KeyframeId, RemovedKeyframe>& all) {
    RaiseKeys(all, shift.keyframe);
    for (auto& [id, keyframe] : all) {
      keyframe.pose.reference += shift.keyframe;
    }
  });
}

void RenumberPoints(const IdShift& shift, PointTable<MapPoint>& points) {
  PointTable<MapPoint>::VisitState(points, [&](std::vector<std::int64_t>& entries, auto&, auto&) {
    constexpr std::int64_t kGone = -1;  // smaller entries are ids of replacements, see PointTable
    for (std::int64_t& entry : entries) {
      entry -= entry < kGone ? shift.point : 0;
    }
    entries.insert(entries.begin(), static_cast<std::size_t>(shift.point), kGone);
  });
  for (const MapPoint& const_point : points) {
    MapPoint& point = points.At(const_point.id + shift.point);
    point.id += shift.point;
    point.first_keyframe += shift.keyframe;
    for (Observation& o : point.observations) {
      o.keyframe += shift.keyframe;
    }
  }
}

}  // namespace

void Renumber(const IdShift& shift, Map& map) {
  Map::VisitState(map, [&](auto& keyframes, auto& removed, auto& points) {
    RenumberKeyframes(shift, keyframes);
    RenumberRemoved(shift, removed);
    RenumberPoints(shift, points);
  });
}

}  // namespace sqslam
