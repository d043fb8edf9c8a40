#include "app/viewer/state/picking.h"

#include <algorithm>
#include <cmath>

namespace sqslam::viewer {
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
    const std::optional<double> distance = MeetCut(ray, object.superquadric, cut);
    if (distance && (!best || *distance < best->distance)) {
      best = Hit{object.id, *distance};
    }
  }
  return best;
}

// The point of a cloud that is seen within reach of the mouse and the nearest to the eye there.
class NearestPoint {
 public:
  NearestPoint(const ViewCamera& camera, cv::Size window, const Eigen::Vector2d& pixel, double reach)
      : pinhole_(PinholeOf(camera, window)),
        T_view_map_(PoseOf(camera).Inverse()),
        pixel_(pixel),
        reach_(reach) {}

  void Offer(const Eigen::Vector3d& p_map, const std::optional<ClipPlane>& cut) {
    const double depth = DepthOf(p_map);
    if (depth <= 0.0 || (point_ && depth >= depth_) || (cut && !cut->Keeps(p_map))) {
      return;
    }
    const Eigen::Vector2d seen = pinhole_.Project(T_view_map_ * p_map) + Eigen::Vector2d::Constant(0.5);
    if ((seen - pixel_).norm() <= reach_) {
      point_ = p_map;
      depth_ = depth;
    }
  }
  double DepthOf(const Eigen::Vector3d& p_map) const { return (T_view_map_ * p_map).z(); }
  const std::optional<Eigen::Vector3d>& Point() const { return point_; }
  double Depth() const { return depth_; }

 private:
  Camera pinhole_;
  Rigid3d T_view_map_;
  Eigen::Vector2d pixel_;
  double reach_;
  std::optional<Eigen::Vector3d> point_;
  double depth_ = 0.0;
};

}  // namespace

std::optional<double> Meet(const Ray& ray, const PosedSuperquadric& solid) {
  const std::optional<Passage> passage = PassageOf(ray, solid);
  return passage ? std::optional(passage->enter) : std::nullopt;
}

std::optional<double> MeetCut(const Ray& ray, const PosedSuperquadric& solid,
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
  NearestPoint nearest(camera, window, pixel, reach);
  for (const SnapshotPoint& point : map.points) {
    nearest.Offer(point.p_map.cast<double>(), cut);
  }
  for (std::size_t i = 0; cloud != nullptr && i < cloud->p_map.size(); ++i) {
    nearest.Offer(cloud->p_map[i].cast<double>(), cut);
  }
  const Ray ray = RayOf(camera, pixel, window);
  if (const std::optional<Hit> hit = NearestHit(ray, map.objects, cut)) {
    const Eigen::Vector3d surface = ray.origin + hit->distance * ray.direction;
    if (!nearest.Point() || nearest.DepthOf(surface) < nearest.Depth()) {
      return surface;
    }
  }
  return nearest.Point();
}

}  // namespace sqslam::viewer
