#include "slam/map/tracking_view.h"

namespace sqslam {

TrackingView MakeTrackingView(const Map& map) {
  constexpr int kNeighbours = 10;
  TrackingView view;
  for (const auto& [id, keyframe] : map.Keyframes()) {
    view.keyframes[id] = {id, keyframe.T_camera_map, keyframe.features, keyframe.points,
                          keyframe.BestCovisible(kNeighbours)};
  }
  for (const auto& [id, removed] : map.Removed()) {
    view.removed_poses[id] = map.PoseOf(id);
  }
  view.points.reserve(map.Points().size());
  for (const MapPoint& point : map.Points()) {
    view.points.push_back({point.p_map, point.normal, point.min_distance, point.max_distance,
                           point.descriptor, point.alive, point.observations.size() >= 3, point.replaced_by});
  }
  return view;
}

}  // namespace sqslam
