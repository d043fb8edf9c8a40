#include "render/camera/view_presets.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <cmath>
#include <map>

#include "slam/geometry/angles.h"
#include "slam/util/error.h"

namespace sqslam {
namespace {

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
