#include "slam/geometry/ray.h"

#include <algorithm>

namespace sqslam {

// RadialScale is a norm of the point, so it is convex along the ray: golden section finds its minimum, and
// bisection the surface (RadialScale = 1) on either side of it.
std::optional<std::pair<double, double>> Intersect(const Ray& ray, const PosedSuperquadric& solid) {
  const Rigid3d T_object_map = solid.T_map_object.Inverse();
  const Eigen::Vector3d origin = T_object_map * ray.origin;
  const Eigen::Vector3d direction = T_object_map.rotation * ray.direction;
  const auto scale = [&](double t) { return solid.shape.RadialScale(origin + t * direction); };
  // Outside of this range the ray is outside of the bounding sphere.
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
  return std::pair(scale(begin) <= 1.0 ? begin : surface(begin), scale(end) <= 1.0 ? end : surface(end));
}

}  // namespace sqslam
