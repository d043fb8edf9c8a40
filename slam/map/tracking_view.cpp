#include "slam/map/tracking_view.h"

namespace sqslam {

TrackingView MakeTrackingView(const Map& map) {
  constexpr int kNeighbours = 10;
  constexpr std::size_t kWellObserved = 3;
  TrackingView view;
  for (const auto& [id, keyframe] : map.Keyframes()) {
    view.keyframes[id] = {id,
                          keyframe.Pose(),
                          keyframe.features,
                          keyframe.words,
                          keyframe.points,
                          keyframe.BestCovisible(kNeighbours)};
  }
  for (const auto& [id, removed] : map.Removed()) {
    view.removed_poses[id] = map.PoseOf(id);
  }
  view.points = map.Points().Map<ViewPoint>([](const MapPoint& point) {
    return ViewPoint{point, point.observations.size() >= kWellObserved};
  });
  return view;
}

}  // namespace sqslam
