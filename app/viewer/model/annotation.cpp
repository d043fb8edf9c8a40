#include "app/viewer/model/annotation.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "slam/geometry/silhouette.h"
#include "slam/util/throw_if.h"

namespace sqslam::viewer {
namespace {

constexpr double kYawHandleDistance = 1.35;  // distance of the yaw handle from the centre, in half sizes

// Intersects a viewing ray with a plane; empty if the ray is nearly parallel to it or points away.
std::optional<Eigen::Vector3d> IntersectPlane(const Ray& ray, const Eigen::Vector3d& normal,
                                              const Eigen::Vector3d& point) {
  constexpr double kMinSine = 0.02;  // sine of the least angle
  const double along = normal.dot(ray.direction.normalized());
  if (std::abs(along) < kMinSine) {
    return std::nullopt;
  }
  const double t = normal.dot(point - ray.origin) / along;
  return t > 0.0 ? std::optional(Eigen::Vector3d(ray.origin + t * ray.direction.normalized())) : std::nullopt;
}

// Returns the position along the line (through `point`, unit `axis`) nearest to the viewing ray; empty if the
// two are nearly parallel.
std::optional<double> NearestAlong(const Ray& ray, const Eigen::Vector3d& point,
                                   const Eigen::Vector3d& axis) {
  const Eigen::Vector3d direction = ray.direction.normalized();
  const double cosine = direction.dot(axis);
  const double sine_square = 1.0 - cosine * cosine;
  if (sine_square < 1e-4) {
    return std::nullopt;
  }
  const Eigen::Vector3d between = ray.origin - point;
  return (axis.dot(between) - cosine * direction.dot(between)) / sine_square;
}

Solid DragCenter(const Solid& start, const Ray& from, const Ray& to) {
  constexpr double kEdgeOnSine = 0.12;  // sine of the angle at which a horizontal plane is seen edge-on
  const Eigen::Vector3d center = start.T_map_object.translation;
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  if (std::abs(from.direction.normalized().z()) < kEdgeOnSine) {
    normal = Eigen::Vector3d(from.direction.x(), from.direction.y(), 0.0).normalized();
  }
  const auto a = IntersectPlane(from, normal, center);
  const auto b = IntersectPlane(to, normal, center);
  Solid moved = start;
  moved.T_map_object.translation += a && b ? Eigen::Vector3d(*b - *a) : Eigen::Vector3d::Zero();
  return moved;
}

Solid DragSide(const Solid& start, const SolidHandle& handle, const Ray& from, const Ray& to) {
  constexpr double kMinHalfSize = 0.02;  // of the half size
  const Eigen::Vector3d axis = start.T_map_object.RotationMatrix().col(handle.axis);
  const Eigen::Vector3d side = HandlePosition(start, handle);
  const std::optional<double> a = NearestAlong(from, side, axis);
  const std::optional<double> b = NearestAlong(to, side, axis);
  Solid changed = start;
  if (!a || !b) {
    return changed;
  }
  const double half = start.half_size[handle.axis];
  const double new_half = std::max(kMinHalfSize * half, half + 0.5 * handle.sign * (*b - *a));
  changed.half_size[handle.axis] = new_half;
  changed.T_map_object.translation += handle.sign * (new_half - half) * axis;
  return changed;
}

Solid DragYaw(const Solid& start, const Ray& from, const Ray& to) {
  const Eigen::Vector3d center = start.T_map_object.translation;
  const auto a = IntersectPlane(from, Eigen::Vector3d::UnitZ(), center);
  const auto b = IntersectPlane(to, Eigen::Vector3d::UnitZ(), center);
  Solid turned = start;
  if (a && b) {
    const Eigen::Vector3d u = *a - center;
    const Eigen::Vector3d v = *b - center;
    SetYaw(turned, YawOf(start) + std::atan2(v.y(), v.x()) - std::atan2(u.y(), u.x()));
  }
  return turned;
}

}  // namespace

int Annotation::Add(AnnotatedSolid solid) {
  CheckSolid(solid.solid);
  solid.id = 1;
  for (const AnnotatedSolid& other : solids) {
    solid.id = std::max(solid.id, other.id + 1);
  }
  solids.push_back(std::move(solid));
  return solids.back().id;
}

void Annotation::Remove(int id) {
  std::erase_if(solids, [id](const AnnotatedSolid& solid) { return solid.id == id; });
}

const AnnotatedSolid* Annotation::Find(int id) const {
  const auto found = std::ranges::find(solids, id, &AnnotatedSolid::id);
  return found == solids.end() ? nullptr : &*found;
}

void Annotation::Replace(const AnnotatedSolid& solid) {
  CheckSolid(solid.solid);
  const auto found = std::ranges::find(solids, solid.id, &AnnotatedSolid::id);
  ThrowIf<UsageError>(found == solids.end(), "the annotation has no solid {}", solid.id);
  *found = solid;
}

void CheckSolid(const Solid& solid) {
  const Eigen::Vector3d& half = solid.half_size;
  ThrowIf<UsageError>(!half.allFinite() || half.minCoeff() <= 0.0,
                      "half sizes {} {} {}: expected three numbers above 0", half.x(), half.y(), half.z());
  for (const double e : {solid.e1, solid.e2}) {
    ThrowIf<UsageError>(!(e >= kMinShapeExponent && e <= kMaxShapeExponent),
                        "exponent {}: expected a number from {} to {}", e, kMinShapeExponent,
                        kMaxShapeExponent);
  }
  ThrowIf<UsageError>(
      !solid.T_map_object.translation.allFinite() || !solid.T_map_object.rotation.coeffs().allFinite(),
      "the centre or the rotation is not finite");
}

Solid UprightSolid(SolidKind kind, const Eigen::Vector3d& center, double yaw,
                   const Eigen::Vector3d& half_size) {
  Solid solid;
  SetKind(solid, kind);
  solid.half_size = half_size;
  solid.T_map_object.translation = center;
  SetYaw(solid, yaw);
  return solid;
}

PosedSuperquadric AsSuperquadric(const Solid& solid) {
  return {{solid.half_size, solid.e1, solid.e2}, solid.T_map_object};
}

double YawOf(const Solid& solid) { return ToParameters(AsSuperquadric(solid))[7]; }

void SetYaw(Solid& solid, double yaw) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(yaw - YawOf(solid), Eigen::Vector3d::UnitZ()));
  solid.T_map_object.rotation = (turn * solid.T_map_object.rotation).normalized();
}

double BottomOf(const Solid& solid) { return solid.BoundingBox().min().z(); }

void SnapToGround(Solid& solid, double ground, GroundSnap how) {
  const double bottom = BottomOf(solid);
  const double top = solid.BoundingBox().max().z();
  if (how == GroundSnap::kExtend && top > ground + 1e-3 * (top - bottom)) {
    solid.half_size.z() = 0.5 * (top - ground);
    solid.T_map_object.translation.z() = 0.5 * (top + ground);
    return;
  }
  solid.T_map_object.translation.z() += ground - bottom;
}

std::array<SolidHandle, 8> SolidHandles() {
  using Kind = SolidHandle::Kind;
  return {{{Kind::kCenter},
           {Kind::kSide, 0, 1},
           {Kind::kSide, 0, -1},
           {Kind::kSide, 1, 1},
           {Kind::kSide, 1, -1},
           {Kind::kSide, 2, 1},
           {Kind::kSide, 2, -1},
           {Kind::kYaw}}};
}

Eigen::Vector3d HandlePosition(const Solid& solid, const SolidHandle& handle) {
  Eigen::Vector3d p_object = Eigen::Vector3d::Zero();
  if (handle.kind == SolidHandle::Kind::kSide) {
    p_object[handle.axis] = handle.sign * solid.half_size[handle.axis];
  } else if (handle.kind == SolidHandle::Kind::kYaw) {
    p_object.x() = solid.half_size.x() + (kYawHandleDistance - 1.0) * solid.half_size.head<2>().maxCoeff();
  }
  return solid.T_map_object * p_object;
}

Solid DragHandle(const Solid& start, const SolidHandle& handle, const Ray& from, const Ray& to) {
  switch (handle.kind) {
    case SolidHandle::Kind::kCenter:
      return DragCenter(start, from, to);
    case SolidHandle::Kind::kSide:
      return DragSide(start, handle, from, to);
    case SolidHandle::Kind::kYaw:
      return DragYaw(start, from, to);
  }
  return start;
}

namespace {

constexpr int kRimSteps = 96;
constexpr double kPixelStep = 8.0;  // pixels between the points of a line curved by distortion

// Projects lines given in the frame of the object.
class LinePainter {
 public:
  LinePainter(const Camera& camera, const Rigid3d& T_camera_object, double near)
      : camera_(camera), T_camera_object_(T_camera_object), near_(near) {}

  // Adds a straight line; nothing if all of it is behind the camera.
  void AddLine(const Eigen::Vector3d& from, const Eigen::Vector3d& to, bool hidden) {
    Eigen::Vector3d a = T_camera_object_ * from;
    Eigen::Vector3d b = T_camera_object_ * to;
    if (std::max(a.z(), b.z()) <= near_) {
      return;
    }
    if (a.z() < near_) {
      a += (near_ - a.z()) / (b.z() - a.z()) * (b - a);
    } else if (b.z() < near_) {
      b += (near_ - b.z()) / (a.z() - b.z()) * (a - b);
    }
    const double length = (camera_.Project(b) - camera_.Project(a)).norm();
    const int pieces =
        camera_.HasDistortion() ? std::clamp(static_cast<int>(std::ceil(length / kPixelStep)), 1, 400) : 1;
    WireLine line;
    line.hidden = hidden;
    for (int i = 0; i <= pieces; ++i) {
      line.pixels.push_back(camera_.ProjectDistorted(a + static_cast<double>(i) / pieces * (b - a)));
    }
    lines_.push_back(std::move(line));
  }

  // Adds a closed curve in steps; `hidden` is evaluated at the middle of each.
  void AddCurve(const std::function<Eigen::Vector3d(double)>& at, const std::function<bool(double)>& hidden) {
    const auto angle = [](double i) { return 2.0 * std::numbers::pi * i / kRimSteps; };
    bool continues = false;  // the previous line ends here
    bool was_hidden = false;
    for (int i = 0; i < kRimSteps; ++i) {
      const std::size_t before = lines_.size();
      const bool is_hidden = hidden(angle(i + 0.5));
      AddLine(at(angle(i)), at(angle(i + 1)), is_hidden);
      if (lines_.size() == before) {
        continues = false;
      } else if (continues && was_hidden == is_hidden) {
        WireLine& line = lines_[before - 1];
        line.pixels.insert(line.pixels.end(), lines_.back().pixels.begin() + 1, lines_.back().pixels.end());
        lines_.pop_back();
      } else {
        continues = true;
        was_hidden = is_hidden;
      }
    }
  }

  std::vector<WireLine> Take() { return std::move(lines_); }

  void Add(WireLine line) { lines_.push_back(std::move(line)); }

 private:
  Camera camera_;
  Rigid3d T_camera_object_;
  double near_;
  std::vector<WireLine> lines_;
};

void AddCuboid(const Eigen::Vector3d& half, const Eigen::Vector3d& eye, LinePainter& painter) {
  const auto faces_eye = [&](int axis, double sign) { return sign * eye[axis] > half[axis]; };
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3;
    const int v = (axis + 2) % 3;
    for (const double su : {-1.0, 1.0}) {
      for (const double sv : {-1.0, 1.0}) {
        Eigen::Vector3d from;
        from[u] = su * half[u];
        from[v] = sv * half[v];
        from[axis] = -half[axis];
        Eigen::Vector3d to = from;
        to[axis] = half[axis];
        painter.AddLine(from, to, !faces_eye(u, su) && !faces_eye(v, sv));
      }
    }
  }
}

void AddCylinder(const Eigen::Vector3d& half, const Eigen::Vector3d& eye, LinePainter& painter) {
  const Eigen::Vector2d unit_eye = eye.head<2>().cwiseQuotient(half.head<2>());  // section as a unit circle
  for (const double sign : {-1.0, 1.0}) {
    const bool lid_seen = sign * eye.z() > half.z();
    painter.AddCurve(
        [&](double a) {
          return Eigen::Vector3d(half.x() * std::cos(a), half.y() * std::sin(a), sign * half.z());
        },
        [&](double a) { return !lid_seen && unit_eye.dot(Eigen::Vector2d(std::cos(a), std::sin(a))) < 1.0; });
  }
  if (unit_eye.norm() > 1.0) {
    const double middle = std::atan2(unit_eye.y(), unit_eye.x());
    const double aside = std::acos(1.0 / unit_eye.norm());
    for (const double a : {middle - aside, middle + aside}) {
      const Eigen::Vector3d top(half.x() * std::cos(a), half.y() * std::sin(a), half.z());
      painter.AddLine({top.x(), top.y(), -half.z()}, top, false);
    }
  }
}

void AddSuperquadric(const PosedSuperquadric& solid, const Camera& camera, const Rigid3d& T_map_camera,
                     const Eigen::Vector3d& eye, LinePainter& painter) {
  const double margin = 2.0 * std::max(camera.width, camera.height);
  std::vector<Eigen::Vector2d> outline = Silhouette(solid, camera, T_map_camera, 0.05, margin);
  if (camera.HasDistortion()) {
    outline = DistortedOutline(outline, camera);
  }
  if (!outline.empty()) {
    outline.push_back(outline.front());
    painter.Add({std::move(outline), false});
  }
  const Superquadric& shape = solid.shape;
  painter.AddCurve([&](double a) { return shape.PointAt(0.0, a); },
                   [&](double a) { return shape.NormalAt(0.0, a).dot(eye - shape.PointAt(0.0, a)) < 0.0; });
}

}  // namespace

std::vector<WireLine> ProjectWireframe(const Solid& solid, const Camera& camera,
                                       const Rigid3d& T_map_camera) {
  constexpr double kNearPlane = 0.01;  // of the solid's size
  const Eigen::Vector3d eye = solid.T_map_object.Inverse() * T_map_camera.translation;
  if (solid.RadialScale(eye) <= 1.0) {
    return {};
  }
  LinePainter painter(camera, T_map_camera.Inverse() * solid.T_map_object,
                      kNearPlane * solid.half_size.minCoeff());
  if (solid.kind == SolidKind::kCuboid) {
    AddCuboid(solid.half_size, eye, painter);
  } else if (solid.kind == SolidKind::kCylinder) {
    AddCylinder(solid.half_size, eye, painter);
  } else {
    AddSuperquadric(AsSuperquadric(solid), camera, T_map_camera, eye, painter);
  }
  return painter.Take();
}

}  // namespace sqslam::viewer
