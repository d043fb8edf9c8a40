#include "slam/geometry/silhouette.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "slam/geometry/superquadric_norm.h"

namespace sqslam {
namespace {

constexpr int kFirstPoints = 16;  // points of the contour before refinement
constexpr int kMaxDepth = 40;     // bisections between two of them
constexpr int kMaxPoints = 4000;

// The norm whose unit sphere is the superquadric with exponents e1, e2 and half sizes 1.
SuperquadricNorm<PNorm> UnitNorm(const Eigen::Vector3d& p, double e1, double e2) {
  return {p, 2.0 / e1, 2.0 / e2};
}

// A point of the contour as seen by the camera.
struct ContourPoint {
  double angle;             // in the plane of the dual
  Eigen::Vector3d ray;      // to the point, camera frame
  Eigen::Vector3d tangent;  // normal of the plane through the camera centre and the tangent, camera frame
};

class Contour {
 public:
  Contour(const PosedSuperquadric& solid, const Rigid3d& T_map_camera)
      : shape_(solid.shape),
        T_camera_object_(T_map_camera.Inverse() * solid.T_map_object),
        eye_((solid.T_map_object.Inverse() * T_map_camera.translation).cwiseQuotient(shape_.half_size)) {
    const SuperquadricNorm<PNorm> at_eye = UnitNorm(eye_, shape_.e1, shape_.e2);
    outside_ = at_eye.Value() > 1.0 + 1e-9;
    inside_ = at_eye.Gradient() / at_eye.Value();
    u_ = eye_.normalized().unitOrthogonal();
    v_ = eye_.normalized().cross(u_);
  }

  bool Outside() const { return outside_; }

  ContourPoint At(double angle) const {
    const Eigen::Vector3d direction = std::cos(angle) * u_ + std::sin(angle) * v_;
    const Eigen::Vector3d normal = inside_ + Reach(direction) * direction;
    const Eigen::Vector3d point = UnitNorm(normal, 2.0 - shape_.e1, 2.0 - shape_.e2).Gradient();
    return {angle, T_camera_object_ * Eigen::Vector3d(shape_.half_size.cwiseProduct(point)),
            (T_camera_object_.rotation * normal.cwiseQuotient(shape_.half_size)).normalized()};
  }

 private:
  // Returns the length at which the ray from the inner point leaves the dual: Newton's method from outside,
  // which never overshoots on a convex function.
  double Reach(const Eigen::Vector3d& direction) const {
    double t = 1.0;
    const auto dual = [&] { return UnitNorm(inside_ + t * direction, 2.0 - shape_.e1, 2.0 - shape_.e2); };
    while (dual().Value() <= 1.0) {
      t *= 2.0;
    }
    for (int i = 0; i < 100; ++i) {
      const SuperquadricNorm<PNorm> norm = dual();
      const double step = (norm.Value() - 1.0) / norm.Gradient().dot(direction);
      t -= step;
      if (!(step > 1e-15 * t)) {
        break;
      }
    }
    return t;
  }

  Superquadric shape_;
  Rigid3d T_camera_object_;
  Eigen::Vector3d eye_;  // object frame, half sizes 1
  bool outside_ = false;
  Eigen::Vector3d inside_;  // a point inside the dual, in the plane of the contour's normals
  Eigen::Vector3d u_, v_;   // basis of that plane
};

// Returns an upper bound on the distance, in pixels, between the curve and the chord of two contour points:
// the distance of the intersection of their tangents. Empty if the tangents do not intersect between the
// points.
std::optional<double> Deviation(const ContourPoint& a, const ContourPoint& b, const Camera& camera) {
  constexpr double kMinDepth = 1e-9;  // share of the distance
  if (a.ray.z() < kMinDepth * a.ray.norm() || b.ray.z() < kMinDepth * b.ray.norm()) {
    return std::nullopt;
  }
  const Eigen::Vector2d from = camera.Project(a.ray);
  const Eigen::Vector2d chord = camera.Project(b.ray) - from;
  const double length = chord.norm();
  if (length < 1e-9) {
    return 0.0;
  }
  const Eigen::Vector3d corner = a.tangent.cross(b.tangent);
  if (corner.norm() < 1e-12 && a.tangent.dot(b.tangent) > 0.0) {
    return 0.0;  // the same tangent: a straight piece
  }
  if (std::abs(corner.z()) < kMinDepth * corner.norm()) {
    return std::nullopt;
  }
  const Eigen::Vector2d side = camera.Project(corner) - from;
  const double along = side.dot(chord) / (length * length);
  if (along < -1e-3 || along > 1.0 + 1e-3) {
    return std::nullopt;
  }
  return std::abs(side.x() * chord.y() - side.y() * chord.x()) / length;
}

// Planes through the camera centre that bound the view, with inward normals.
using ViewPlanes = std::array<Eigen::Vector3d, 5>;

// Returns true if one plane hides the whole curve between two points: both points and the intersection of
// their tangents.
bool IsHidden(const ContourPoint& a, const ContourPoint& b, const ViewPlanes& planes) {
  Eigen::Vector3d corner = a.tangent.cross(b.tangent);
  corner *= corner.dot(a.ray.normalized() + b.ray.normalized()) < 0.0 ? -1.0 : 1.0;
  return std::ranges::any_of(planes, [&](const Eigen::Vector3d& plane) {
    return plane.dot(a.ray) < 0.0 && plane.dot(b.ray) < 0.0 && plane.dot(corner) <= 0.0;
  });
}

void Refine(const Contour& contour, const ContourPoint& a, const ContourPoint& b, const Camera& camera,
            const ViewPlanes& planes, double tolerance, int depth, std::vector<Eigen::Vector3d>& rays) {
  const std::optional<double> deviation = Deviation(a, b, camera);
  if ((deviation && *deviation <= tolerance) || IsHidden(a, b, planes) || depth >= kMaxDepth ||
      rays.size() >= kMaxPoints) {
    rays.push_back(b.ray);
    return;
  }
  const ContourPoint middle = contour.At(0.5 * (a.angle + b.angle));
  Refine(contour, a, middle, camera, planes, tolerance, depth + 1, rays);
  Refine(contour, middle, b, camera, planes, tolerance, depth + 1, rays);
}

// Clips a cone of rays to the side of a plane through the camera centre where plane . ray >= 0.
std::vector<Eigen::Vector3d> Clip(const std::vector<Eigen::Vector3d>& cone, const Eigen::Vector3d& plane) {
  std::vector<Eigen::Vector3d> kept;
  for (std::size_t i = 0; i < cone.size(); ++i) {
    const Eigen::Vector3d& from = cone[i];
    const Eigen::Vector3d& to = cone[(i + 1) % cone.size()];
    const double at_from = plane.dot(from);
    const double at_to = plane.dot(to);
    if (at_from >= 0.0) {
      kept.push_back(from);
    }
    if ((at_from >= 0.0) != (at_to >= 0.0)) {
      kept.push_back(from + at_from / (at_from - at_to) * (to - from));
    }
  }
  return kept;
}

// Returns left, top, right and bottom of the image area in undistorted pixels, grown by a margin.
std::array<double, 4> ImageBounds(const Camera& camera, double margin) {
  std::array<double, 4> bounds = {-0.5, -0.5, camera.width - 0.5, camera.height - 0.5};
  if (camera.HasDistortion()) {
    constexpr int kSteps = 8;
    for (int i = 0; i <= kSteps; ++i) {
      const double x = -0.5 + static_cast<double>(camera.width) * i / kSteps;
      const double y = -0.5 + static_cast<double>(camera.height) * i / kSteps;
      bounds[0] = std::min(bounds[0], camera.Undistort({-0.5, y}).x());
      bounds[1] = std::min(bounds[1], camera.Undistort({x, -0.5}).y());
      bounds[2] = std::max(bounds[2], camera.Undistort({camera.width - 0.5, y}).x());
      bounds[3] = std::max(bounds[3], camera.Undistort({x, camera.height - 0.5}).y());
    }
  }
  return {bounds[0] - margin, bounds[1] - margin, bounds[2] + margin, bounds[3] + margin};
}

}  // namespace

std::vector<Eigen::Vector2d> Silhouette(const PosedSuperquadric& solid, const Camera& camera,
                                        const Rigid3d& T_map_camera, double tolerance, double margin) {
  const Contour contour(solid, T_map_camera);
  if (!contour.Outside()) {
    return {};
  }
  const auto [left, top, right, bottom] = ImageBounds(camera, margin);
  const ViewPlanes planes = {Eigen::Vector3d::UnitZ(),
                             {camera.fx, 0.0, camera.cx - left},
                             {-camera.fx, 0.0, right - camera.cx},
                             {0.0, camera.fy, camera.cy - top},
                             {0.0, -camera.fy, bottom - camera.cy}};
  std::vector<Eigen::Vector3d> cone;
  ContourPoint last = contour.At(0.0);
  for (int i = 1; i <= kFirstPoints; ++i) {
    const ContourPoint next = contour.At(2.0 * std::numbers::pi * i / kFirstPoints);
    Refine(contour, last, next, camera, planes, tolerance, 0, cone);
    last = next;
  }
  for (const Eigen::Vector3d& plane : planes) {
    cone = Clip(cone, plane);
  }
  std::vector<Eigen::Vector2d> outline;
  for (const Eigen::Vector3d& ray : cone) {
    if (ray.z() > 0.0) {
      outline.push_back(camera.Project(ray));
    }
  }
  return outline.size() >= 3 ? outline : std::vector<Eigen::Vector2d>();
}

std::vector<Eigen::Vector2d> DistortedOutline(const std::vector<Eigen::Vector2d>& outline,
                                              const Camera& camera, double step) {
  std::vector<Eigen::Vector2d> distorted;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Eigen::Vector2d& from = outline[i];
    const Eigen::Vector2d& to = outline[(i + 1) % outline.size()];
    const int pieces = std::max(1, static_cast<int>(std::ceil((to - from).norm() / step)));
    for (int k = 0; k < pieces; ++k) {
      const double t = static_cast<double>(k) / pieces;
      distorted.push_back(camera.ProjectDistorted(camera.Unproject((1.0 - t) * from + t * to)));
    }
  }
  return distorted;
}

}  // namespace sqslam
