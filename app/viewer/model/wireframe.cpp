#include "app/viewer/model/wireframe.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>

#include "app/viewer/model/annotation.h"
#include "slam/geometry/silhouette.h"

namespace sqslam::viewer {
namespace {

constexpr int kRimSteps = 96;
constexpr double kStep = 8.0;  // pixels between points of a line that distortion bends

// Projects lines of the object's frame.
class LinePainter {
 public:
  LinePainter(const Camera& camera, const Rigid3d& T_camera_object, double near)
      : camera_(camera), T_camera_object_(T_camera_object), near_(near) {}

  // A straight line; nothing where all of it is behind the camera.
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
        camera_.HasDistortion() ? std::clamp(static_cast<int>(std::ceil(length / kStep)), 1, 400) : 1;
    WireLine line;
    line.hidden = hidden;
    for (int i = 0; i <= pieces; ++i) {
      line.pixels.push_back(camera_.ProjectDistorted(a + static_cast<double>(i) / pieces * (b - a)));
    }
    lines_.push_back(std::move(line));
  }

  // A closed curve in steps; `hidden` of the middle of each.
  void AddCurve(const std::function<Eigen::Vector3d(double)>& at, const std::function<bool(double)>& hidden) {
    const auto angle = [](double i) { return 2.0 * std::numbers::pi * i / kRimSteps; };
    bool goes_on = false;  // whether the line before reaches up to here
    bool was_hidden = false;
    for (int i = 0; i < kRimSteps; ++i) {
      const std::size_t before = lines_.size();
      const bool is_hidden = hidden(angle(i + 0.5));
      AddLine(at(angle(i)), at(angle(i + 1)), is_hidden);
      if (lines_.size() == before) {
        goes_on = false;
      } else if (goes_on && was_hidden == is_hidden) {
        WireLine& line = lines_[before - 1];
        line.pixels.insert(line.pixels.end(), lines_.back().pixels.begin() + 1, lines_.back().pixels.end());
        lines_.pop_back();
      } else {
        goes_on = true;
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
  const Eigen::Vector2d unit_eye = eye.head<2>().cwiseQuotient(half.head<2>());  // the section: a unit circle
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
  constexpr double kNear = 0.01;  // of the solid's size
  const Eigen::Vector3d eye = solid.T_map_object.Inverse() * T_map_camera.translation;
  if (solid.RadialScale(eye) <= 1.0) {
    return {};
  }
  LinePainter painter(camera, T_map_camera.Inverse() * solid.T_map_object,
                      kNear * solid.half_size.minCoeff());
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
