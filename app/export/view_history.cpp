#include "app/export/view_history.h"

#include <algorithm>

#include "slam/util/statistics.h"

namespace sqslam::app {

ViewHistory ReadHistory(const RecordingReader& reader) {
  ViewHistory history;
  for (int i = 0; i < reader.Size(); ++i) {
    const MapSnapshotPtr map = reader.Read(i);
    for (const SnapshotObject& object : map->objects) {
      history.first_seen.try_emplace(object.id, map->timestamp);
    }
    for (const SnapshotDetection& seen : map->detections) {
      if (seen.object_id >= 0) {
        history.seen_in[map->frame_index].insert(seen.object_id);
      }
    }
  }
  return history;
}

std::vector<std::size_t> FirstViews(const MapSnapshot& map, const std::vector<Eigen::Vector3f>& points) {
  constexpr double kReach = 2.5;  // of the median depth of what is in view
  const std::size_t last = map.keyframes.empty() ? 0 : map.keyframes.size() - 1;
  std::vector<std::size_t> first(points.size(), last);
  std::vector<bool> seen(points.size(), false);
  std::vector<std::pair<std::size_t, double>> in_view;  // point, depth
  for (std::size_t k = 0; k < map.keyframes.size(); ++k) {
    const Rigid3d T_camera_map = map.keyframes[k].T_map_camera.Inverse();
    const Eigen::Matrix3f rotation = T_camera_map.RotationMatrix().cast<float>();
    const Eigen::Vector3f translation = T_camera_map.translation.cast<float>();
    in_view.clear();
    std::vector<double> depths;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Eigen::Vector3d p = (rotation * points[i] + translation).cast<double>();
      if (p.z() > 0.0 && map.camera.InImage(map.camera.Project(p))) {
        depths.push_back(p.z());
        if (!seen[i]) {
          in_view.emplace_back(i, p.z());
        }
      }
    }
    const double farthest = depths.empty() ? 0.0 : kReach * LowerQuantile(std::move(depths), 0.5);
    for (const auto& [i, depth] : in_view) {
      if (depth <= farthest) {
        seen[i] = true;
        first[i] = k;
      }
    }
  }
  return first;
}

}  // namespace sqslam::app
