#include "app/viewer/state/scene_view.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

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

SceneStyle SceneView::StyleWithClip() const {
  SceneStyle all = style;
  all.clip = clip;
  return all;
}

namespace {

// Without the lens of an input camera: a view that is moved by hand is no longer that camera's.
ViewCamera Free(ViewCamera camera) {
  camera.pinhole.reset();
  return camera;
}

ViewCamera Shifted(const ViewCamera& camera, const Eigen::Vector3d& shift) {
  ViewCamera moved = Free(camera);
  moved.position += shift;
  moved.focal_point += shift;
  return moved;
}

// Map units at the focal point for one pixel.
double UnitsPerPixel(const ViewCamera& camera, cv::Size window) {
  return camera.Distance() / camera.FocalLength(std::max(window.height, 1));
}

}  // namespace

ViewCamera Orbit(const ViewCamera& camera, const Eigen::Vector2d& pixels, cv::Size window,
                 const Eigen::Vector3d& up) {
  const double turn = 180.0 / std::max(window.height, 1);  // degrees a pixel
  ViewCamera moved = Free(camera);
  const Eigen::Vector3d offset = camera.position - camera.focal_point;
  // From straight above the heading is that of the picture's top.
  if (offset.normalized().cross(up).norm() < 0.02) {
    moved.position -= 0.02 * offset.norm() * (camera.view_up - camera.view_up.dot(up) * up).normalized();
  }
  moved.view_up = up;
  return Elevation(Azimuth(moved, -turn * pixels.x()), turn * pixels.y());
}

ViewCamera LookAround(const ViewCamera& camera, const Eigen::Vector2d& pixels, cv::Size window,
                      const Eigen::Vector3d& up) {
  const double turn = camera.view_angle / std::max(window.height, 1);  // degrees a pixel
  ViewCamera moved = Free(camera);
  moved.view_up = up;
  std::swap(moved.position, moved.focal_point);  // the focal point turns about the eye
  moved = Elevation(Azimuth(moved, -turn * pixels.x()), -turn * pixels.y());
  std::swap(moved.position, moved.focal_point);
  return moved;
}

ViewCamera Pan(const ViewCamera& camera, const Eigen::Vector2d& pixels, cv::Size window) {
  const ViewAxes axes = AxesOf(camera);
  const double unit = UnitsPerPixel(camera, window);
  return Shifted(camera, unit * (pixels.y() * axes.up - pixels.x() * axes.right));
}

ViewCamera ZoomTo(const ViewCamera& camera, double factor, const Eigen::Vector2d& pixel, cv::Size window) {
  const ViewAxes axes = AxesOf(camera);
  const double unit = UnitsPerPixel(camera, window);
  const Eigen::Vector2d offset = pixel - 0.5 * Eigen::Vector2d(window.width, window.height);
  const Eigen::Vector3d target = camera.focal_point + unit * (offset.x() * axes.right - offset.y() * axes.up);
  ViewCamera moved = Free(camera);
  moved.position = target + (camera.position - target) / factor;
  moved.focal_point = target + (camera.focal_point - target) / factor;
  return moved;
}

ViewCamera Fly(const ViewCamera& camera, const Eigen::Vector3d& right_up_forward) {
  const ViewAxes axes = AxesOf(camera);
  return Shifted(camera, right_up_forward.x() * axes.right + right_up_forward.y() * axes.up -
                             right_up_forward.z() * axes.back);
}

Camera PinholeOf(const ViewCamera& camera, cv::Size window) {
  Camera pinhole;
  if (camera.pinhole) {
    pinhole = *camera.pinhole;
    const double x = static_cast<double>(window.width) / pinhole.width;
    const double y = static_cast<double>(window.height) / pinhole.height;
    pinhole.fx *= x;
    pinhole.fy *= y;
    pinhole.cx = (pinhole.cx + 0.5) * x - 0.5;
    pinhole.cy = (pinhole.cy + 0.5) * y - 0.5;
    pinhole.distortion = {};
  } else {
    pinhole.fx = pinhole.fy = camera.FocalLength(window.height);
    pinhole.cx = 0.5 * (window.width - 1);
    pinhole.cy = 0.5 * (window.height - 1);
  }
  pinhole.width = window.width;
  pinhole.height = window.height;
  return pinhole;
}

Ray RayOf(const ViewCamera& camera, const Eigen::Vector2d& pixel, cv::Size window) {
  const Camera pinhole = PinholeOf(camera, window);
  const Rigid3d T_map_view = PoseOf(camera);
  // Pixels of the window count from its corner, those of a camera from the middle of the first one.
  const Eigen::Vector3d direction = pinhole.Unproject(pixel - Eigen::Vector2d::Constant(0.5));
  return {T_map_view.translation, (T_map_view.rotation * direction).normalized()};
}

ViewCamera Between(const ViewCamera& from, const ViewCamera& to, double t) {
  if (t >= 1.0) {
    return to;
  }
  const double s = t * t * (3.0 - 2.0 * t);
  const Rigid3d a = PoseOf(from);
  const Rigid3d b = PoseOf(to);
  const Eigen::Quaterniond rotation = a.rotation.slerp(s, b.rotation);
  const double distance = std::exp((1.0 - s) * std::log(from.Distance()) + s * std::log(to.Distance()));
  ViewCamera view;
  view.focal_point = (1.0 - s) * from.focal_point + s * to.focal_point;
  view.position = view.focal_point - distance * (rotation * Eigen::Vector3d::UnitZ());
  view.view_up = rotation * -Eigen::Vector3d::UnitY();
  view.view_angle = (1.0 - s) * from.view_angle + s * to.view_angle;
  return view;
}

namespace {

// The piece of a ray inside of a solid.
struct Passage {
  double enter = 0.0;
  double leave = 0.0;
};

// RadialScale is a norm of the point, so it is convex along the ray: its minimum is found by golden section,
// and the surface lies where it falls to 1 on the way there, and where it rises to 1 behind it.
std::optional<Passage> PassageOf(const Ray& ray, const PosedSuperquadric& solid) {
  const Rigid3d T_object_map = solid.T_map_object.Inverse();
  const Eigen::Vector3d origin = T_object_map * ray.origin;
  const Eigen::Vector3d direction = T_object_map.rotation * ray.direction;
  const auto scale = [&](double t) { return solid.shape.RadialScale(origin + t * direction); };
  // Beyond that the ray is outside of a ball around the solid.
  const double radius = solid.shape.half_size.norm();
  const double nearest = -origin.dot(direction);
  double low = std::max(0.0, nearest - radius);
  double high = nearest + radius;
  if (high <= 0.0) {
    return std::nullopt;
  }
  const double begin = low;
  const double end = high;
  constexpr double kGolden = 0.6180339887498949;
  for (int i = 0; i < 60; ++i) {
    const double a = high - kGolden * (high - low);
    const double b = low + kGolden * (high - low);
    (scale(a) < scale(b) ? high : low) = scale(a) < scale(b) ? b : a;
  }
  const double middle = 0.5 * (low + high);
  if (scale(middle) > 1.0) {
    return std::nullopt;
  }
  const auto surface = [&](double outside) {
    double inside = middle;
    for (int i = 0; i < 60; ++i) {
      const double between = 0.5 * (inside + outside);
      (scale(between) <= 1.0 ? inside : outside) = between;
    }
    return inside;
  };
  return Passage{scale(begin) <= 1.0 ? begin : surface(begin), scale(end) <= 1.0 ? end : surface(end)};
}

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
  const std::optional<Passage> passage = PassageOf(ray, solid);
  if (!passage) {
    return std::nullopt;
  }
  for (const double distance : {passage->enter, passage->leave}) {
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
                                         const std::optional<ClipPlane>& cut, const ColoredPoints* cloud,
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
  for (std::size_t i = 0; cloud != nullptr && i < cloud->p_map.size(); ++i) {
    offer(cloud->p_map[i].cast<double>());
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
