#include "render/camera/scene_framing.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "slam/geometry/angles.h"
#include "slam/util/error.h"
#include "slam/util/statistics.h"

namespace sqslam {
namespace {

double Percentile(std::vector<double> values, double q) {
  return values.empty() ? 0.0 : LowerQuantile(std::move(values), q);
}

Eigen::Vector3d Percentiles(const std::vector<Eigen::Vector3d>& points, double q) {
  Eigen::Vector3d result;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    values.reserve(points.size());
    for (const Eigen::Vector3d& p : points) {
      values.push_back(p[axis]);
    }
    result[axis] = Percentile(std::move(values), q);
  }
  return result;
}

void AppendCorners(const Eigen::Vector3d& low, const Eigen::Vector3d& high,
                   std::vector<Eigen::Vector3d>& corners) {
  for (int i = 0; i < 8; ++i) {
    corners.emplace_back(i & 1 ? high.x() : low.x(), i & 2 ? high.y() : low.y(), i & 4 ? high.z() : low.z());
  }
}

// Corners of the objects' boxes; objects far outside the crowd of the others are left out.
std::vector<Eigen::Vector3d> ObjectCorners(const MapSnapshot& map) {
  std::vector<Eigen::Vector3d> centers;
  for (const SnapshotObject& object : map.objects) {
    centers.push_back(object.superquadric.T_map_object.translation);
  }
  const Eigen::Vector3d middle = Percentiles(centers, 0.5);
  std::vector<double> distances;
  for (const Eigen::Vector3d& center : centers) {
    distances.push_back((center - middle).norm());
  }
  const double limit = 4.0 * Percentile(distances, 0.7);
  std::vector<Eigen::Vector3d> corners;
  for (std::size_t i = 0; i < centers.size(); ++i) {
    if (distances[i] <= limit || centers.size() < 4) {
      const std::array<Eigen::Vector3d, 8> box = BoxCorners(map.objects[i].superquadric);
      corners.insert(corners.end(), box.begin(), box.end());
    }
  }
  return corners;
}

std::vector<Eigen::Vector3d> PointsInside(const MapSnapshot& map, const Eigen::Vector3d& low,
                                          const Eigen::Vector3d& high) {
  std::vector<Eigen::Vector3d> inside;
  for (const SnapshotPoint& point : map.points) {
    const Eigen::Vector3d p = point.p_map.cast<double>();
    if ((p.array() >= low.array()).all() && (p.array() <= high.array()).all()) {
      inside.push_back(p);
    }
  }
  return inside;
}

std::vector<Eigen::Vector3d> Outline(const MapSnapshot& map) {
  std::vector<Eigen::Vector3d> outline = ObjectCorners(map);
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Eigen::Vector3d low = Eigen::Vector3d::Constant(-kInfinity);
  Eigen::Vector3d high = Eigen::Vector3d::Constant(kInfinity);
  double tail = 0.08;
  if (!outline.empty()) {
    low = high = outline.front();
    for (const Eigen::Vector3d& p : outline) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    const double margin = 0.25 * (high - low).norm();  // surroundings
    low.array() -= margin;
    high.array() += margin;
    tail = 0.05;
  }
  const std::vector<Eigen::Vector3d> near = PointsInside(map, low, high);
  if (near.size() >= 20) {
    AppendCorners(Percentiles(near, tail), Percentiles(near, 1.0 - tail), outline);
  }
  if (outline.empty()) {
    for (const SnapshotKeyframe& keyframe : map.keyframes) {
      outline.push_back(keyframe.T_map_camera.translation);
    }
  }
  return outline;
}

// The map's z, or against the cameras' own down where gravity is not known.
Eigen::Vector3d UpDirection(const MapSnapshot& map) {
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  if (!map.gravity_known) {
    for (const SnapshotKeyframe& keyframe : map.keyframes) {
      up -= keyframe.T_map_camera.rotation * Eigen::Vector3d::UnitY();
    }
  }
  return up.norm() > 1e-6 ? up.normalized() : Eigen::Vector3d::UnitZ();
}

// Level, from the centre to the side of the cameras.
Eigen::Vector3d FrontDirection(const MapSnapshot& map, const SceneFocus& focus) {
  Eigen::Vector3d side = Eigen::Vector3d::Zero();
  for (const SnapshotKeyframe& keyframe : map.keyframes) {
    side += (keyframe.T_map_camera.translation - focus.center).normalized();
  }
  side -= side.dot(focus.up) * focus.up;
  const double agreement =
      map.keyframes.empty() ? 0.0 : side.norm() / static_cast<double>(map.keyframes.size());
  if (agreement < 0.05) {  // cameras all around: any side is as good
    side = focus.up.cross(Eigen::Vector3d::UnitX());
    side = side.norm() > 0.1 ? Eigen::Vector3d(-side) : focus.up.unitOrthogonal();
  }
  return side.normalized();
}

struct Direction {
  double azimuth;    // degrees from the front, counter-clockwise seen from above
  double elevation;  // degrees
};

const std::map<std::string, Direction>& Directions() {
  static const std::map<std::string, Direction> directions = {
      {"front", {0.0, 0.0}},  {"right", {90.0, 0.0}}, {"back", {180.0, 0.0}},
      {"left", {-90.0, 0.0}}, {"top", {0.0, 90.0}},   {"isometric", {45.0, 35.264}}};
  return directions;
}

}  // namespace

std::array<Eigen::Vector3d, 8> BoxCorners(const PosedSuperquadric& solid) {
  const Eigen::Vector3d& a = solid.shape.half_size;
  std::array<Eigen::Vector3d, 8> corners;
  for (int i = 0; i < 8; ++i) {
    corners[static_cast<std::size_t>(i)] =
        solid.T_map_object *
        Eigen::Vector3d(i & 1 ? a.x() : -a.x(), i & 2 ? a.y() : -a.y(), i & 4 ? a.z() : -a.z());
  }
  return corners;
}

SceneFocus FindFocus(const MapSnapshot& map) {
  SceneFocus focus;
  focus.up = UpDirection(map);
  focus.outline = Outline(map);
  if (focus.outline.empty()) {
    focus.front = FrontDirection(map, focus);
    return focus;
  }
  Eigen::Vector3d low = focus.outline.front();
  Eigen::Vector3d high = low;
  double lowest = low.dot(focus.up);
  for (const Eigen::Vector3d& p : focus.outline) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
    lowest = std::min(lowest, p.dot(focus.up));
  }
  focus.center = 0.5 * (low + high);
  focus.radius = std::max(0.5 * (high - low).norm(), 1e-6);
  focus.ground_height = map.gravity_known && map.support_height ? *map.support_height : lowest;
  std::vector<double> depths;
  for (const SnapshotKeyframe& keyframe : map.keyframes) {
    depths.push_back((keyframe.T_map_camera.translation - focus.center).norm());
  }
  focus.front = FrontDirection(map, focus);
  focus.view_depth = depths.empty() ? 2.0 * focus.radius : Percentile(depths, 0.5);
  return focus;
}

ViewCamera FitOutline(const ViewCamera& camera, const std::vector<Eigen::Vector3d>& outline, double aspect,
                      double margin) {
  const Eigen::Vector3d back = (camera.position - camera.focal_point).normalized();
  const Eigen::Vector3d right = camera.view_up.cross(back).normalized();
  const Eigen::Vector3d up = back.cross(right);
  const double tan_y = std::tan(0.5 * camera.view_angle * std::numbers::pi / 180.0) * (1.0 - 2.0 * margin);
  const double tan_x = tan_y * aspect;
  ViewCamera fitted = camera;
  for (int round = 0; round < 4; ++round) {  // centring changes the distance and the other way round
    double distance = 1e-6;
    for (const Eigen::Vector3d& p : outline) {
      const Eigen::Vector3d d = p - fitted.focal_point;
      distance = std::max({distance, std::abs(d.dot(right)) / tan_x + d.dot(back),
                           std::abs(d.dot(up)) / tan_y + d.dot(back)});
    }
    fitted.position = fitted.focal_point + distance * back;
    Eigen::Vector2d low = Eigen::Vector2d::Constant(1e9);
    Eigen::Vector2d high = -low;
    for (const Eigen::Vector3d& p : outline) {
      const Eigen::Vector3d d = p - fitted.position;
      const Eigen::Vector2d seen = Eigen::Vector2d(d.dot(right), d.dot(up)) / std::max(-d.dot(back), 1e-9);
      low = low.cwiseMin(seen);
      high = high.cwiseMax(seen);
    }
    const Eigen::Vector2d shift = 0.5 * (low + high) * distance;
    if (round < 3) {
      fitted.focal_point += shift.x() * right + shift.y() * up;
      fitted.position += shift.x() * right + shift.y() * up;
    }
  }
  return fitted;
}

ViewCamera FrameScene(const SceneFocus& focus, double aspect, double view_angle) {
  ViewCamera camera;
  camera.focal_point = focus.center;
  camera.view_up = focus.up;
  camera.view_angle = view_angle;
  camera.position = focus.center + 3.0 * focus.radius * focus.front;
  camera = Elevation(Azimuth(camera, 25.0), 32.0);
  return FitOutline(camera, focus.outline.empty() ? std::vector{focus.center} : focus.outline, aspect);
}

double RoundLength(double length) {
  const double power = std::pow(10.0, std::floor(std::log10(std::max(length, 1e-12))));
  const double lead = length / power;
  return (lead >= 5.0 ? 5.0 : lead >= 2.0 ? 2.0 : 1.0) * power;
}

const std::vector<std::string>& ViewPresetNames() {
  static const std::vector<std::string> names = {"front", "right", "back", "left", "top", "isometric"};
  return names;
}

ViewCamera PresetView(const std::string& name, const SceneFocus& focus, double aspect, double view_angle) {
  const auto found = Directions().find(name);
  if (found == Directions().end()) {
    throw UsageError(fmt::format("view {}: unknown, expected {}", name, fmt::join(ViewPresetNames(), ", ")));
  }
  const Eigen::Vector3d up = focus.up.normalized();
  const Eigen::Vector3d level =
      Eigen::AngleAxisd(found->second.azimuth * kRadiansPerDegree, up) * focus.front;
  const double elevation = found->second.elevation * kRadiansPerDegree;
  ViewCamera camera;
  camera.focal_point = focus.center;
  camera.position =
      focus.center + 3.0 * focus.radius * (std::cos(elevation) * level + std::sin(elevation) * up);
  camera.view_up = found->second.elevation >= 90.0 ? Eigen::Vector3d(-focus.front) : up;
  camera.view_angle = view_angle;
  return FitOutline(camera, focus.outline.empty() ? std::vector{focus.center} : focus.outline, aspect);
}

}  // namespace sqslam
