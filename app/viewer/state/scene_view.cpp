#include "app/viewer/state/scene_view.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <limits>
#include <utility>

#include "render/picture/photo.h"
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
  const auto triple = [](const Eigen::Vector3d& v) { return fmt::format("[{:.7g}]", fmt::join(v, ", ")); };
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
  SetStyle(settings, next);
  CheckStyle(next);
  next.covisibility.show = style.covisibility.show;
  next.covisibility.min_points = style.covisibility.min_points;
  style = std::move(next);
  colors = LabelColors(style.objects.colors);
  style_name = name;
}

ViewCamera LookThrough(const Rigid3d& T_map_camera, const Camera& camera, cv::Size window, double depth) {
  ViewCamera view = FirstPerson(T_map_camera, camera, depth);
  if (camera.width > 0 && camera.height > 0 && camera.fx > 0.0 && camera.fy > 0.0 && window.area() > 0) {
    view.pinhole = PlaceImage(camera, {cv::Point(), window}).camera;
    // Keeps the scale when the user moves the view away from the camera.
    view.view_angle = 2.0 * std::atan(0.5 * window.height / view.pinhole->fy) * kDegreesPerRadian;
  }
  return view;
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
    const std::optional<double> distance = HitDistance(ray, object.superquadric, cut);
    if (distance && (!best || *distance < best->distance)) {
      best = Hit{object.id, *distance};
    }
  }
  return best;
}

}  // namespace

std::optional<double> HitDistance(const Ray& ray, const PosedSuperquadric& solid,
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
