#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "app/export/map_view.h"
#include "render/picture/photo.h"
#include "render/solids/scene_order.h"
#include "slam/util/statistics.h"
#include "slam/util/to_vector.h"

namespace sqslam::app {

ViewHistory ReadHistory(const RecordingReader& reader) {
  ViewHistory history;
  for (int i = 0; i < reader.Size(); ++i) {
    const MapSnapshotPtr map = reader.Read(i);
    if (!map->image_path.empty()) {
      history.image_files.emplace(map->frame_index, map->image_path);
    }
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

std::vector<SeenOutline> FindOutlines(const MapSnapshot& map, const ViewHistory& history, double tolerance) {
  const Camera& camera = map.camera;
  if (camera.width <= 0 || !(camera.fx > 0.0)) {
    return {};
  }
  const double area = static_cast<double>(camera.width) * camera.height;
  const cv::Rect image(0, 0, camera.width, camera.height);
  const SolidOrder solids(ToVector(map.objects, &SnapshotObject::superquadric));  // the same for all views
  std::vector<SeenOutline> outlines;
  for (std::size_t k = 0; k < map.keyframes.size(); ++k) {
    const SnapshotKeyframe& keyframe = map.keyframes[k];
    const auto seen = history.seen_in.find(keyframe.frame_index);
    for (const ObjectOutline& outline : OutlinesOf(map.objects, solids, camera, keyframe.T_map_camera)) {
      SeenOutline& out = outlines.emplace_back();
      out.keyframe = k;
      out.object = static_cast<std::size_t>(outline.object - map.objects.data());
      out.detected = seen != history.seen_in.end() && seen->second.contains(outline.object->id);
      const std::vector<cv::Point2f> exact(outline.polygon.begin(), outline.polygon.end());
      std::vector<cv::Point2f> simple;
      cv::approxPolyDP(exact, simple, tolerance, true);
      for (const cv::Point2f& p : simple) {
        out.polygon.emplace_back(cvRound(p.x), cvRound(p.y));
      }
      const cv::Rect bounds = cv::boundingRect(out.polygon);
      const cv::Rect inside = bounds & image;
      out.whole = inside == bounds;
      out.share = cv::contourArea(out.polygon) * inside.area() / std::max(1, bounds.area()) / area;
    }
  }
  return outlines;
}

std::vector<std::size_t> FirstViews(const MapSnapshot& map, const std::vector<Eigen::Vector3f>& points) {
  constexpr double kReach = 2.5;  // times the median depth of the points in view
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
      if (p.z() > 0.0 && map.camera.Shows(map.camera.Project(p))) {
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
