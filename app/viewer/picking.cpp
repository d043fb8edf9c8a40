#include "app/viewer/picking.h"

#include <algorithm>
#include <cmath>

namespace sqslam::viewer {

// RadialScale is a norm of the point, so it is convex along the ray: its minimum is found by golden section,
// and the surface lies where it falls to 1 on the way there.
std::optional<double> Meet(const Ray& ray, const PosedSuperquadric& solid) {
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
  constexpr double kGolden = 0.6180339887498949;
  for (int i = 0; i < 60; ++i) {
    const double a = high - kGolden * (high - low);
    const double b = low + kGolden * (high - low);
    (scale(a) < scale(b) ? high : low) = scale(a) < scale(b) ? b : a;
  }
  double inside = 0.5 * (low + high);
  if (scale(inside) > 1.0) {
    return std::nullopt;
  }
  double outside = begin;
  if (scale(outside) <= 1.0) {
    return outside;
  }
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (inside + outside);
    (scale(middle) <= 1.0 ? inside : outside) = middle;
  }
  return inside;
}

namespace {

struct Hit {
  int id = 0;
  double distance = 0.0;
};

std::optional<Hit> NearestHit(const Ray& ray, const std::vector<SnapshotObject>& objects) {
  std::optional<Hit> best;
  for (const SnapshotObject& object : objects) {
    const std::optional<double> distance = Meet(ray, object.superquadric);
    if (distance && (!best || *distance < best->distance)) {
      best = Hit{object.id, *distance};
    }
  }
  return best;
}

}  // namespace

std::optional<int> PickObject(const Ray& ray, const std::vector<SnapshotObject>& objects) {
  const std::optional<Hit> hit = NearestHit(ray, objects);
  return hit ? std::optional(hit->id) : std::nullopt;
}

std::optional<Eigen::Vector3d> PickPoint(const ViewCamera& camera, const Eigen::Vector2d& pixel,
                                         cv::Size window, const MapSnapshot& map, double reach) {
  const Ray ray = RayOf(camera, pixel, window);
  const Camera pinhole = PinholeOf(camera, window);
  const Rigid3d T_view_map = PoseOf(camera).Inverse();
  std::optional<Eigen::Vector3d> best;
  double best_depth = 0.0;
  for (const SnapshotPoint& point : map.points) {
    const Eigen::Vector3d p = T_view_map * point.p_map.cast<double>();
    if (p.z() <= 0.0 || (best && p.z() >= best_depth)) {
      continue;
    }
    const Eigen::Vector2d seen = pinhole.Project(p) + Eigen::Vector2d::Constant(0.5);
    if ((seen - pixel).norm() <= reach) {
      best = point.p_map.cast<double>();
      best_depth = p.z();
    }
  }
  const std::optional<Hit> hit = NearestHit(ray, map.objects);
  if (hit) {
    const Eigen::Vector3d surface = ray.origin + hit->distance * ray.direction;
    if (!best || (T_view_map * surface).z() < best_depth) {
      return surface;
    }
  }
  return best;
}

}  // namespace sqslam::viewer
