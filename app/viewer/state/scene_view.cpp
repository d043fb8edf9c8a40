#include "app/viewer/state/scene_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "slam/geometry/angles.h"

namespace sqslam::viewer {

void CameraKeys::Add(const ViewCamera& camera) {
  keys.push_back({keys.empty() ? 0.0 : keys.back().time + interval, camera});
}

void CameraKeys::Remove(std::size_t index) {
  if (index >= keys.size()) {
    return;
  }
  const double gap = index + 1 < keys.size() ? keys[index + 1].time - keys[index].time : 0.0;
  keys.erase(keys.begin() + static_cast<std::ptrdiff_t>(index));
  for (std::size_t i = index; i < keys.size(); ++i) {
    keys[i].time -= gap;
  }
}

std::string CameraKeys::Yaml() const {
  const auto triple = [](const Eigen::Vector3d& v) {
    return fmt::format("[{:.7g}, {:.7g}, {:.7g}]", v.x(), v.y(), v.z());
  };
  std::string text =
      "# Set by hand in sqslam-viewer; sqslam render --camera-path plays it.\neasing: smooth\n";
  if (loop && !keys.empty()) {
    text += fmt::format("loop: true\nduration: {:.7g}\n", keys.back().time + interval);
  }
  text += "keys:\n";
  for (const Key& key : keys) {
    text +=
        fmt::format("  - {{time: {:.7g}, position: {}, focal_point: {}, view_up: {}, view_angle: {:.7g}}}\n",
                    key.time, triple(key.camera.position), triple(key.camera.focal_point),
                    triple(key.camera.view_up), key.camera.view_angle);
  }
  return text;
}

void SceneView::MoveTo(const ViewCamera& place) {
  camera = place;
  preset = "";
  automatic = false;
  mode = CameraMode::kFree;
}

ViewCamera SceneView::Named(const std::string& name) const {
  const double aspect = size.height > 0 ? static_cast<double>(size.width) / size.height : 16.0 / 9.0;
  return name.empty() ? FrameScene(focus, aspect) : PresetView(name, focus, aspect);
}

void SceneView::LookFrom(const std::string& name) {
  camera = Named(name);
  mode = CameraMode::kFree;
  preset = name;
  automatic = true;
}

void SceneView::UseStyle(const std::string& name) {
  SceneStyle next = LoadStyle(name);
  next.covisibility.show = style.covisibility.show;
  next.covisibility.min_points = style.covisibility.min_points;
  style = std::move(next);
  style_name = name;
}

ViewCamera LookThrough(const Rigid3d& T_map_camera, const Camera& camera, cv::Size window, double depth) {
  ViewCamera view = FirstPerson(T_map_camera, camera, depth);
  // The principal point is in the middle of the window: the farther edge decides.
  const double across = std::max(camera.cx + 0.5, camera.width - camera.cx - 0.5) / camera.fx;
  const double down = std::max(camera.cy + 0.5, camera.height - camera.cy - 0.5) / camera.fy;
  const double slope = std::max(down, across * window.height / std::max(window.width, 1));
  view.view_angle =
      slope > 0.0 && std::isfinite(slope) ? 2.0 * std::atan(slope) * kDegreesPerRadian : view.view_angle;
  return view;
}

cv::Rect2d PhotoArea(const Camera& camera, const ViewCamera& view, cv::Size window) {
  const double focal = view.FocalLength(window.height);
  const double x = focal / camera.fx, y = focal / camera.fy;  // window pixels per image pixel
  return {0.5 * window.width - x * (camera.cx + 0.5), 0.5 * window.height - y * (camera.cy + 0.5),
          x * camera.width, y * camera.height};
}

SceneStyle SceneView::StyleWithClip() const {
  SceneStyle all = style;
  all.clip = clip;
  return all;
}

namespace {

struct Hit {
  int id = 0;
  double distance = 0.0;
};

std::optional<Hit> NearestHit(const Ray& ray, const std::vector<SnapshotObject>& objects,
                              const std::optional<ClipPlane>& cut) {
  std::optional<Hit> best;
  for (const SnapshotObject& object : objects) {
    const std::optional<double> distance = Meet(ray, object.superquadric, cut);
    if (distance && (!best || *distance < best->distance)) {
      best = Hit{object.id, *distance};
    }
  }
  return best;
}

}  // namespace

std::optional<double> Meet(const Ray& ray, const PosedSuperquadric& solid,
                           const std::optional<ClipPlane>& cut) {
  const auto passage = Intersect(ray, solid);
  if (!passage) {
    return std::nullopt;
  }
  for (const double distance : {passage->first, passage->second}) {
    if (!cut || cut->Keeps(ray.origin + distance * ray.direction)) {
      return distance;
    }
  }
  return std::nullopt;
}

std::optional<int> PickObject(const Ray& ray, const std::vector<SnapshotObject>& objects,
                              const std::optional<ClipPlane>& cut) {
  const std::optional<Hit> hit = NearestHit(ray, objects, cut);
  return hit ? std::optional(hit->id) : std::nullopt;
}

std::optional<Eigen::Vector3d> PickPoint(const ViewCamera& camera, const Eigen::Vector2d& pixel,
                                         cv::Size window, const MapSnapshot& map,
                                         const std::optional<ClipPlane>& cut, const CloudLayer* cloud,
                                         double reach) {
  const Camera pinhole = PinholeOf(camera, window);
  const Rigid3d T_view_map = PoseOf(camera).Inverse();
  std::optional<Eigen::Vector3d> nearest;
  double depth = std::numeric_limits<double>::infinity();
  const auto offer = [&](const Eigen::Vector3d& p_map) {
    const Eigen::Vector3d p = T_view_map * p_map;
    if (p.z() <= 0.0 || p.z() >= depth || (cut && !cut->Keeps(p_map))) {
      return;
    }
    if ((pinhole.Project(p) + Eigen::Vector2d::Constant(0.5) - pixel).norm() <= reach) {
      nearest = p_map;
      depth = p.z();
    }
  };
  for (const SnapshotPoint& point : map.points) {
    offer(point.p_map.cast<double>());
  }
  if (cloud != nullptr) {
    for (const CloudPoint& point : cloud->points) {
      offer(point.p_map.cast<double>());
    }
  }
  const Ray ray = RayOf(camera, pixel, window);
  if (const std::optional<Hit> hit = NearestHit(ray, map.objects, cut)) {
    const Eigen::Vector3d surface = ray.origin + hit->distance * ray.direction;
    if ((T_view_map * surface).z() < depth) {
      return surface;
    }
  }
  return nearest;
}

}  // namespace sqslam::viewer
