#include "render/camera/scene_framing.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <optional>

#include "slam/geometry/angles.h"
#include "slam/util/statistics.h"
#include "slam/util/throw_if.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

Eigen::Vector3d Percentiles(const std::vector<Eigen::Vector3d>& points, double q) {
  Eigen::Vector3d result;
  for (int axis = 0; axis < 3; ++axis) {
    result[axis] = LowerQuantile(ToVector(points, [axis](const Eigen::Vector3d& p) { return p[axis]; }), q);
  }
  return result;
}

Eigen::AlignedBox3d BoxAround(const std::vector<Eigen::Vector3d>& points) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& p : points) {
    box.extend(p);
  }
  return box;
}

std::array<Eigen::Vector3d, 8> CornersOf(const Eigen::AlignedBox3d& box) {
  std::array<Eigen::Vector3d, 8> corners;
  for (std::size_t i = 0; i < 8; ++i) {
    corners[i] = box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(i));
  }
  return corners;
}

// Returns the corners of the objects' bounding boxes, without objects far from all others.
std::vector<Eigen::Vector3d> ObjectCorners(const MapSnapshot& map, const FramedParts& parts) {
  std::vector<PosedSuperquadric> solids;
  std::vector<Eigen::Vector3d> centers;
  for (const SnapshotObject& object : map.objects) {
    if (parts.objects && (parts.uncertain_objects || IsReliable(object))) {
      solids.push_back(object.superquadric);
      centers.push_back(object.superquadric.T_map_object.translation);
    }
  }
  if (solids.empty()) {
    return {};
  }
  const Eigen::Vector3d middle = Percentiles(centers, 0.5);
  std::vector<double> distances =
      ToVector(centers, [&](const Eigen::Vector3d& center) { return (center - middle).norm(); });
  const double limit = 4.0 * LowerQuantile(distances, 0.7);
  std::vector<Eigen::Vector3d> corners;
  for (std::size_t i = 0; i < centers.size(); ++i) {
    if (distances[i] <= limit || centers.size() < 4) {
      const std::array<Eigen::Vector3d, 8> box = BoxCorners(solids[i]);
      corners.insert(corners.end(), box.begin(), box.end());
    }
  }
  return corners;
}

std::vector<Eigen::Vector3d> Outline(const MapSnapshot& map, const FramedParts& parts) {
  std::vector<Eigen::Vector3d> outline = ObjectCorners(map, parts);
  Eigen::AlignedBox3d around = BoxAround(outline);
  if (!outline.empty()) {  // with a margin for the surroundings
    const double margin = 0.25 * around.diagonal().norm();
    around.min().array() -= margin;
    around.max().array() += margin;
  }
  std::vector<Eigen::Vector3d> near;
  for (const SnapshotPoint& point : map.points) {
    if (parts.points && (outline.empty() || around.contains(point.p_map.cast<double>()))) {
      near.push_back(point.p_map.cast<double>());
    }
  }
  if (near.size() >= 20) {
    const double tail = outline.empty() ? 0.08 : 0.05;
    const auto corners = CornersOf({Percentiles(near, tail), Percentiles(near, 1.0 - tail)});
    outline.insert(outline.end(), corners.begin(), corners.end());
  }
  if (outline.empty()) {
    for (const SnapshotKeyframe& keyframe : map.keyframes) {
      outline.push_back(keyframe.T_map_camera.translation);
    }
  }
  return outline;
}

// Returns the map's z axis, or the cameras' mean up direction if gravity is not known.
Eigen::Vector3d UpDirection(const MapSnapshot& map) {
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  if (!map.gravity_known) {
    for (const SnapshotKeyframe& keyframe : map.keyframes) {
      up -= keyframe.T_map_camera.rotation * Eigen::Vector3d::UnitY();
    }
  }
  return up.norm() > 1e-6 ? up.normalized() : Eigen::Vector3d::UnitZ();
}

// Returns the height of the map's main support, of the floor if that support is a table among things that
// stand on the floor, or without a known support of the lowest point.
double GroundHeight(const MapSnapshot& map, const SceneFocus& focus) {
  constexpr double kMinFloorDepth = 0.15;  // of the focus' radius, below the main support
  const auto lowest = [&](std::span<const Eigen::Vector3d> points) {
    double height = std::numeric_limits<double>::infinity();
    for (const Eigen::Vector3d& p : points) {
      height = std::min(height, p.dot(focus.up));
    }
    return height;
  };
  if (!map.gravity_known || !map.support_height) {
    return lowest(focus.outline);
  }
  std::vector<double> feet;
  for (const SnapshotObject& object : map.objects) {
    const double foot = lowest(BoxCorners(object.superquadric));
    if (IsReliable(object) && foot < *map.support_height - kMinFloorDepth * focus.radius) {
      feet.push_back(foot);
    }
  }
  return feet.empty() ? *map.support_height : LowerQuantile(std::move(feet), 0.5);
}

// Returns the horizontal direction from the centre towards the cameras.
Eigen::Vector3d FrontDirection(const MapSnapshot& map, const SceneFocus& focus) {
  Eigen::Vector3d side = Eigen::Vector3d::Zero();
  for (const SnapshotKeyframe& keyframe : map.keyframes) {
    side += (keyframe.T_map_camera.translation - focus.center).normalized();
  }
  side -= side.dot(focus.up) * focus.up;
  const double agreement =
      map.keyframes.empty() ? 0.0 : side.norm() / static_cast<double>(map.keyframes.size());
  if (agreement < 0.05) {  // cameras all around: any side will do
    side = focus.up.cross(Eigen::Vector3d::UnitX());
    side = side.norm() > 0.1 ? Eigen::Vector3d(-side) : focus.up.unitOrthogonal();
  }
  return side.normalized();
}

struct Direction {
  const char* name;
  double azimuth;    // degrees from the front, counter-clockwise seen from above
  double elevation;  // degrees
};
constexpr std::array<Direction, 6> kPresets = {{{"front", 0.0, 0.0},
                                                {"right", 90.0, 0.0},
                                                {"back", 180.0, 0.0},
                                                {"left", -90.0, 0.0},
                                                {"top", 0.0, 90.0},
                                                {"isometric", 45.0, 35.264}}};

}  // namespace

std::array<Eigen::Vector3d, 8> BoxCorners(const PosedSuperquadric& solid) {
  const Eigen::Vector3d& a = solid.shape.half_size;
  std::array<Eigen::Vector3d, 8> corners = CornersOf({-a, a});
  for (Eigen::Vector3d& corner : corners) {
    corner = solid.T_map_object * corner;
  }
  return corners;
}

SceneFocus FindFocus(const MapSnapshot& map, const FramedParts& parts) {
  SceneFocus focus;
  focus.up = UpDirection(map);
  focus.outline = Outline(map, {});
  if (focus.outline.empty()) {
    focus.front = FrontDirection(map, focus);
    return focus;
  }
  const Eigen::AlignedBox3d box = BoxAround(focus.outline);
  focus.center = 0.5 * (box.min() + box.max());
  focus.radius = std::max(0.5 * box.diagonal().norm(), 1e-6);
  focus.ground_height = GroundHeight(map, focus);
  std::vector<double> depths = ToVector(map.keyframes, [&](const SnapshotKeyframe& keyframe) {
    return (keyframe.T_map_camera.translation - focus.center).norm();
  });
  focus.front = FrontDirection(map, focus);
  focus.view_depth = depths.empty() ? 2.0 * focus.radius : LowerQuantile(depths, 0.5);
  focus.outline = Outline(map, parts);  // what is drawn does not affect the scale
  for (const SnapshotKeyframe& keyframe : map.keyframes) {
    if (parts.path) {
      focus.outline.push_back(keyframe.T_map_camera.translation);
    }
  }
  return focus;
}

void IncludeCloud(const std::vector<Eigen::Vector3d>& cloud, SceneFocus& focus) {
  constexpr double kMargin = 0.2;         // margin: share of the outline's diagonal without the cloud
  constexpr double kOutlierShare = 0.01;  // share of outliers cut off at each side
  constexpr int kDirections = 40;         // on a half sphere; each gives two opposite sides
  Eigen::AlignedBox3d about = BoxAround(focus.outline);
  const double margin = kMargin * about.diagonal().norm();
  about.min().array() -= margin;
  about.max().array() += margin;
  std::vector<Eigen::Vector3d> bulk;
  std::ranges::copy_if(cloud, std::back_inserter(bulk),
                       [&about](const Eigen::Vector3d& p) { return about.isEmpty() || about.contains(p); });
  std::vector<bool> stray(bulk.size());
  for (int i = 0; i < kDirections; ++i) {  // Fibonacci lattice
    const double z = (i + 0.5) / kDirections, turn = kGoldenAngle * i;
    const double level = std::sqrt(1.0 - z * z);
    const Eigen::Vector3d direction(level * std::cos(turn), level * std::sin(turn), z);
    std::vector<double> along = ToVector(bulk, [&](const Eigen::Vector3d& p) { return p.dot(direction); });
    if (along.empty()) {
      return;
    }
    const double first = LowerQuantile(along, kOutlierShare),
                 last = LowerQuantile(along, 1.0 - kOutlierShare);
    for (std::size_t k = 0; k < bulk.size(); ++k) {
      stray[k] = stray[k] || along[k] < first || along[k] > last;
    }
  }
  for (std::size_t k = 0; k < bulk.size(); ++k) {
    if (!stray[k]) {
      focus.outline.push_back(bulk[k]);
    }
  }
}

namespace {

// Converts a part of a picture to tangents of the angles from its centre, right and up.
Eigen::AlignedBox2d TangentsOf(const ViewCamera& camera, double aspect, const PicturePart& part) {
  const double up = std::tan(0.5 * camera.view_angle * kRadiansPerDegree);
  const Eigen::Array2d whole(up * aspect, -up);
  const Eigen::Vector2d a = (2.0 * part.min().array() - 1.0) * whole,
                        b = (2.0 * part.max().array() - 1.0) * whole;
  return {a.cwiseMin(b), a.cwiseMax(b)};
}

// Returns the smallest distance from the focal point, along the line of sight, that keeps the outline inside.
double DistanceFor(const ViewCamera& camera, const std::vector<Eigen::Vector3d>& outline,
                   const Eigen::AlignedBox2d& tangents) {
  const auto [right, up, back] = AxesOf(camera);
  double distance = 1e-6;
  for (const Eigen::Vector3d& p : outline) {
    const Eigen::Vector3d d = p - camera.focal_point;
    const double x = d.dot(right), y = d.dot(up), nearer = camera.IsOrthographic() ? 0.0 : d.dot(back);
    distance = std::max({distance, x / (x > 0.0 ? tangents.max() : tangents.min()).x() + nearer,
                         y / (y > 0.0 ? tangents.max() : tangents.min()).y() + nearer});
  }
  return distance;
}

// Projects a point to tangents, x right and y up.
Eigen::Vector2d SeenAt(const ViewCamera& camera, const ViewAxes& axes, const Eigen::Vector3d& p) {
  const Eigen::Vector3d d = p - camera.position;
  const double depth = camera.IsOrthographic() ? camera.Distance() : -d.dot(axes.back);
  return Eigen::Vector2d(d.dot(axes.right), d.dot(axes.up)) / std::max(depth, 1e-9);
}

}  // namespace

PicturePart WithinMargin(double margin) {
  return {Eigen::Vector2d::Constant(margin), Eigen::Vector2d::Constant(1.0 - margin)};
}

ViewCamera FitOutline(const ViewCamera& camera, const std::vector<Eigen::Vector3d>& outline, double aspect,
                      const PicturePart& part) {
  const ViewAxes axes = AxesOf(camera);
  const Eigen::AlignedBox2d tangents = TangentsOf(camera, aspect, part);
  ViewCamera fitted = camera;
  for (int round = 0; round < 4; ++round) {  // centring changes the distance, and vice versa
    const double distance = DistanceFor(fitted, outline, tangents);
    fitted.position = fitted.focal_point + distance * axes.back;
    Eigen::AlignedBox2d seen;
    for (const Eigen::Vector3d& p : outline) {
      seen.extend(SeenAt(fitted, axes, p));
    }
    const Eigen::Vector2d shift = (seen.center() - tangents.center()) * distance;
    if (round < 3) {
      fitted.focal_point += shift.x() * axes.right + shift.y() * axes.up;
      fitted.position += shift.x() * axes.right + shift.y() * axes.up;
    }
  }
  return fitted;
}

ViewCamera FitBeside(const ViewCamera& camera, const std::vector<Eigen::Vector3d>& outline, double aspect,
                     std::span<const PicturePart> written) {
  constexpr double kGap = 0.015;          // between outline and text; share of the picture
  constexpr double kMinHalfExtent = 0.1;  // minimum extent to each side of the centre
  std::vector<PicturePart> parts = {WithinMargin(0.08)};
  for (const PicturePart& text : written) {
    for (std::size_t i = 0, before = parts.size(); i < before; ++i) {
      for (int axis = 0; axis < 2; ++axis) {
        PicturePart part = parts[i];
        if (text.center()[axis] < 0.5) {
          part.min()[axis] = std::max(part.min()[axis], text.max()[axis] + kGap);
        } else {
          part.max()[axis] = std::min(part.max()[axis], text.min()[axis] - kGap);
        }
        if (part.min()[axis] < 0.5 - kMinHalfExtent && part.max()[axis] > 0.5 + kMinHalfExtent) {
          parts.push_back(part);
        }
      }
    }
  }
  const ViewAxes axes = AxesOf(camera);
  std::optional<ViewCamera> nearest;
  for (const PicturePart& part : parts) {
    const ViewCamera view = FitOutline(camera, outline, aspect, part);
    const bool clear = std::ranges::none_of(written, [&](const PicturePart& text) {
      const Eigen::AlignedBox2d tangents = TangentsOf(view, aspect, text);
      return std::ranges::any_of(
          outline, [&](const Eigen::Vector3d& p) { return tangents.contains(SeenAt(view, axes, p)); });
    });
    if (clear && (!nearest || view.Distance() < nearest->Distance())) {
      nearest = view;
    }
  }
  return nearest ? *nearest : FitOutline(camera, outline, aspect, parts.front());
}

double DistanceForAll(const std::vector<ViewCamera>& views, const std::vector<Eigen::Vector3d>& outline,
                      double aspect, double margin) {
  double distance = 0.0;
  for (const ViewCamera& view : views) {
    distance = std::max({distance, view.Distance(),
                         DistanceFor(view, outline, TangentsOf(view, aspect, WithinMargin(margin)))});
  }
  return distance;
}

namespace {

// Returns the direction at the top of a plan, with the front as far down as the main direction allows.
Eigen::Vector3d TopOfPlan(const SceneFocus& focus, double aspect) {
  const Eigen::Vector3d main = *focus.main_direction;
  const Eigen::Vector3d top = aspect >= 1.0 ? focus.up.normalized().cross(main) : main;
  return top.dot(focus.front) > 0.0 ? Eigen::Vector3d(-top) : top;
}

ViewCamera ViewFrom(const Direction& direction, const SceneFocus& focus, double aspect, double view_angle,
                    Projection projection) {
  const Eigen::Vector3d up = focus.up.normalized();
  const Eigen::Vector3d level = Eigen::AngleAxisd(direction.azimuth * kRadiansPerDegree, up) * focus.front;
  const double elevation = direction.elevation * kRadiansPerDegree;
  ViewCamera camera;
  camera.focal_point = focus.center;
  camera.position =
      focus.center + 3.0 * focus.radius * (std::cos(elevation) * level + std::sin(elevation) * up);
  camera.view_up = direction.elevation >= 90.0 ? Eigen::Vector3d(-focus.front) : up;
  camera.view_angle = view_angle;
  camera.projection = projection;
  if (camera.IsOrthographic() && direction.elevation >= 90.0 && focus.main_direction) {
    camera.view_up = TopOfPlan(focus, aspect);
  }
  return FitOutline(camera, focus.outline.empty() ? std::vector{focus.center} : focus.outline, aspect);
}

}  // namespace

ViewCamera FrameScene(const SceneFocus& focus, double aspect, double view_angle, Projection projection) {
  return ViewFrom({"automatic", 25.0, 32.0}, focus, aspect, view_angle, projection);
}

double RoundLength(double length) {
  const double power = std::pow(10.0, std::floor(std::log10(std::max(length, 1e-12))));
  const double lead = length / power;
  return (lead >= 5.0 ? 5.0 : lead >= 2.0 ? 2.0 : 1.0) * power;
}

std::vector<std::string> ViewPresetNames() {
  return ToVector(kPresets, [](const Direction& preset) { return std::string(preset.name); });
}

ViewCamera PresetView(const std::string& name, const SceneFocus& focus, double aspect, double view_angle,
                      Projection projection) {
  const auto found = std::ranges::find(kPresets, name, &Direction::name);
  ThrowIf<UsageError>(found == kPresets.end(), "view {}: unknown, expected {}", name,
                      fmt::join(ViewPresetNames(), ", "));
  return ViewFrom(*found, focus, aspect, view_angle, projection);
}

Eigen::Vector3d MainDirection(const std::vector<Eigen::Vector3d>& points, const Eigen::Vector3d& up) {
  constexpr int kBins = 100;              // across the points
  constexpr double kOutlierShare = 0.02;  // cut off at each side
  const auto along = [&](const Eigen::Vector3d& axis) {
    return ToVector(points, [&](const Eigen::Vector3d& p) { return p.dot(axis); });
  };
  const auto extent = [&](const Eigen::Vector3d& axis) {
    return LowerQuantile(along(axis), 1.0 - kOutlierShare) - LowerQuantile(along(axis), kOutlierShare);
  };
  const Eigen::Vector3d start = up.unitOrthogonal();
  if (points.empty()) {
    return start;
  }
  const double bin = std::max({extent(start), extent(up.cross(start)), 1e-9}) / kBins;
  Eigen::Vector3d best = start;
  int most = 0;
  for (int degrees = 0; degrees < 180; ++degrees) {
    const Eigen::Vector3d direction = Eigen::AngleAxisd(degrees * kRadiansPerDegree, up) * start;
    std::map<double, int> counts;
    for (const double place : along(up.cross(direction))) {
      const int count = ++counts[std::floor(place / bin)];
      if (count > most) {
        most = count;
        best = direction;
      }
    }
  }
  return best;
}

Eigen::Vector3d MainDirectionOf(const MapSnapshot& map, const std::vector<Eigen::Vector3d>& cloud,
                                const SceneFocus& focus) {
  constexpr double kReach = 1.5;  // of the focus' radius; distant background has no walls
  std::vector<Eigen::Vector3d> points = cloud;
  const auto add = [&](const Eigen::Vector3d& p) {
    if (cloud.empty() && (p - focus.center).norm() < kReach * focus.radius) {
      points.push_back(p);
    }
  };
  for (const SnapshotPoint& point : map.points) {
    add(point.p_map.cast<double>());
  }
  for (const SnapshotKeyframe& keyframe : map.keyframes) {
    add(keyframe.T_map_camera.translation);
  }
  return MainDirection(points, focus.up.normalized());
}

}  // namespace sqslam
