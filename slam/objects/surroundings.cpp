#include "slam/objects/surroundings.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <ranges>

#include "slam/objects/landmark_geometry.h"
#include "slam/util/statistics.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

// Horizontal gap between the two, share of the size of `other`.
double Gap(const PosedSuperquadric& other, const PosedSuperquadric& object) {
  Eigen::Vector3d p = other.T_map_object.Inverse() * object.T_map_object.translation;
  p.z() = 0.0;
  return other.shape.RadialDistance(p) / other.shape.half_size.norm();
}

// Parameters at which the line p + t v enters and leaves a box about the origin, and the axis of the face
// where it enters.
struct Passage {
  double enter = -std::numeric_limits<double>::infinity();
  double leave = std::numeric_limits<double>::infinity();
  int axis = 0;
};

Passage PassageThrough(const Eigen::Vector3d& half_size, const Eigen::Vector3d& p, const Eigen::Vector3d& v) {
  Passage passage;
  for (int axis = 0; axis < 3; ++axis) {
    const double middle = -p[axis] / v[axis];
    const double reach = std::abs(half_size[axis] / v[axis]);
    if (middle - reach > passage.enter) {
      passage.enter = middle - reach;
      passage.axis = axis;
    }
    passage.leave = std::min(passage.leave, middle + reach);
  }
  return passage;
}

// True if the solid hides what lies at `depth` on the line of sight through `pixel`. It must leave the solid
// before, unless it enters through the top of a low one: the hull of a chair is empty at its corners, but
// tables have tops.
bool IsBlocked(const Eigen::Vector2d& pixel, double depth, const Rigid3d& T_other_camera,
               const Camera& camera, const Superquadric& other) {
  constexpr int kSteps = 16;
  constexpr double kNearest = 0.1;  // shares of the depth
  constexpr double kFarthest = 0.92;
  const Eigen::Vector3d ray = depth * camera.Unproject(pixel);
  for (int i = 0; i <= kSteps; ++i) {
    const double share = kNearest + (kFarthest - kNearest) * i / kSteps;
    const Eigen::Vector3d p = T_other_camera * (share * ray);
    // Most are outside the bounding box, which saves the powers.
    if ((p.cwiseAbs() - other.half_size).maxCoeff() < 0.0 && other.RadialScale(p) < 1.0) {
      const Passage passage =
          PassageThrough(other.half_size, T_other_camera.translation, T_other_camera.rotation * ray);
      const bool low = other.half_size.z() < std::sqrt(other.half_size.head<2>().prod());
      return passage.leave < 1.0 || (low && passage.axis == 2);
    }
  }
  return false;
}

// True if `other` may stand on the object: above it, on a surface `tolerance` from its top.
bool MayStandOn(const Landmark& other, const PosedSuperquadric& object, double tolerance) {
  if (!other.support) {
    return false;
  }
  const double top = object.T_map_object.translation.z() + object.shape.half_size.z();
  Eigen::Vector3d p = object.T_map_object.Inverse() * other.superquadric.T_map_object.translation;
  p.z() = 0.0;
  return std::abs(*other.support - top) < tolerance && object.shape.RadialScale(p) < 1.0;
}

// True if `other` stands on the landmark and not on a wider one: cups over a chair that is pushed under a
// table stand on the table.
bool StandsOn(const Landmark& other, const Landmark& landmark, std::span<const Landmark* const> shown) {
  constexpr double kAbout = 0.15;  // of the landmark's height
  const auto area = [](const Landmark& l) { return l.superquadric.shape.half_size.head<2>().prod(); };
  const double tolerance = kAbout * 2.0 * landmark.superquadric.shape.half_size.z();
  return MayStandOn(other, landmark.superquadric, tolerance) &&
         std::ranges::none_of(shown, [&](const Landmark* third) {
           return third->id != other.id && area(*third) > area(landmark) &&
                  MayStandOn(other, third->superquadric, tolerance);
         });
}

// True if at least half of a better known object of a larger class lies in the landmark.
bool Holds(const Landmark& landmark, const Landmark& other, const ClassPriors& classes) {
  constexpr double kHeld = 0.5;
  const std::optional<double>& size = classes.Of(landmark.labels.Best()).log_metres;
  const std::optional<double>& other_size = classes.Of(other.labels.Best()).log_metres;
  return size && other_size && *other_size > *size && other.observations > landmark.observations &&
         other.reliability > landmark.reliability &&
         other.superquadric.shape.Volume() < landmark.superquadric.shape.Volume() &&
         OverlapOfSmaller(other.superquadric, landmark.superquadric) > kHeld;
}

// Height down to which an object was seen for certain; minus infinity with few points.
double LowestSeen(std::span<const std::pair<std::int64_t, Eigen::Vector3d>> points) {
  constexpr std::size_t kFew = 10;
  constexpr std::size_t kStray = 10;  // every tenth point may lie too low
  if (points.size() < kFew) {
    return -std::numeric_limits<double>::infinity();
  }
  std::vector<double> heights =
      ToVector(points | std::views::values, [](const Eigen::Vector3d& p) { return p.z(); });
  return NthSmallest(heights, heights.size() / kStray);
}

}  // namespace

Surroundings SurroundingsOf(const Landmark& landmark, std::span<const Landmark* const> shown,
                            const ClassPriors& classes) {
  constexpr double kMuchSmaller = 0.7;  // volumes
  constexpr double kNear = 0.5;
  Surroundings result;
  if (!landmark.estimated) {
    return result;
  }
  const bool on_floor = classes.Of(landmark.labels.Best()).on_floor;
  const double volume = landmark.superquadric.shape.Volume();
  double nearest = kNear;
  std::vector<double> tops;
  for (const Landmark* other : shown) {
    if (other->id == landmark.id) {
      continue;
    }
    result.others.push_back(other->superquadric);
    result.holds_larger = result.holds_larger || Holds(landmark, *other, classes);
    if (other->superquadric.shape.Volume() < kMuchSmaller * volume) {
      result.smaller.push_back(other->superquadric);
      if (StandsOn(*other, landmark, shown)) {
        tops.push_back(*other->support);
      }
    }
    if (MayHide(other->superquadric, landmark.visible, landmark.points, on_floor)) {
      result.hiders.push_back(other->superquadric);
      const double gap = Gap(other->superquadric, landmark.visible);
      if (other->support && gap < nearest) {
        nearest = gap;
        result.hidden_support = other->support;
      }
    }
  }
  if (!tops.empty()) {
    result.top_height = UpperMedian(std::move(tops));
  }
  return result;
}

bool MayHide(const PosedSuperquadric& other, const PosedSuperquadric& object,
             std::span<const std::pair<std::int64_t, Eigen::Vector3d>> points, bool on_floor) {
  constexpr double kMuchLarger = 4.0;  // volumes
  // Every superquadric fills between 1/6 (the octahedron) and all of its bounding box, which usually decides.
  const double other_box = other.shape.half_size.prod();
  const double object_box = object.shape.half_size.prod();
  if (other_box < kMuchLarger / 6.0 * object_box ||
      other.shape.Volume() < kMuchLarger * object.shape.Volume()) {
    return false;
  }
  if (on_floor) {
    return true;
  }
  const double bottom =
      std::max(object.T_map_object.translation.z() - object.shape.half_size.z(), LowestSeen(points));
  Eigen::Vector3d p_other = other.T_map_object.Inverse() * object.T_map_object.translation;
  p_other.z() = 0.0;
  return other.shape.RadialScale(p_other) > 1.0 || bottom < other.T_map_object.translation.z();
}

std::array<bool, 4> EdgesHiddenBy(const Box2d& box, double depth, const Rigid3d& T_map_camera,
                                  const Camera& camera, const PosedSuperquadric& other) {
  const Rigid3d T_other_camera = other.T_map_object.Inverse() * T_map_camera;
  // The solid must come close to the line of sight through the centre of the box to matter at all.
  const double reach =
      other.shape.half_size.norm() + 0.5 * std::hypot(box.width, box.height) * depth / camera.fx;
  const Eigen::Vector3d far_end = depth * camera.Unproject(box.Center());
  const Eigen::Vector3d camera_centre = T_other_camera.translation;
  const Eigen::Vector3d way = T_other_camera * far_end - camera_centre;
  const double nearest = std::clamp(-camera_centre.dot(way) / way.squaredNorm(), 0.0, 1.0);
  if ((camera_centre + nearest * way).norm() > reach) {
    return {};
  }
  const double outward = 3.0 + 0.05 * std::max(box.width, box.height);
  std::array<bool, 4> blocked{};
  for (int edge = 0; edge < 4; ++edge) {
    int count = 0;
    for (const double along : {0.25, 0.5, 0.75}) {
      const double x = edge == 0   ? box.x - outward
                       : edge == 2 ? box.x + box.width + outward
                                   : box.x + along * box.width;
      const double y = edge == 1   ? box.y - outward
                       : edge == 3 ? box.y + box.height + outward
                                   : box.y + along * box.height;
      count += IsBlocked({x, y}, depth, T_other_camera, camera, other.shape) ? 1 : 0;
    }
    blocked[static_cast<std::size_t>(edge)] = count >= 2;
  }
  std::array<bool, 4> hidden{};
  for (std::size_t edge = 0; edge < 4; ++edge) {
    hidden[edge] = blocked[edge] && !blocked[(edge + 2) % 4];
  }
  const double bottom = other.T_map_object.translation.z() - other.shape.half_size.z();
  if (bottom < (T_map_camera * far_end).z()) {
    hidden[kTopEdge] = false;
  }
  return hidden;
}

std::array<bool, 4> HiddenEdges(const BoxView& view, const PosedSuperquadric& object,
                                const PosedSuperquadric& other, const Camera& camera) {
  const double depth = (view.T_map_camera.Inverse() * object.T_map_object.translation).z();
  return depth <= 0.0
             ? std::array<bool, 4>()
             : EdgesHiddenBy(UndistortBox(view.box, camera), depth, view.T_map_camera, camera, other);
}

Eigen::Vector3d DirectionToTableAxis(const PosedSuperquadric& table, const Eigen::Vector3d& p_map) {
  const Eigen::Vector3d p = table.T_map_object.Inverse() * p_map;
  const Eigen::Array2d half = table.shape.half_size.head<2>();
  const Eigen::Array2d reach = half - half.minCoeff();
  Eigen::Vector3d middle = p;
  middle.head<2>() = p.head<2>().array().max(-reach).min(reach);
  return table.T_map_object.rotation * (middle - p);
}

}  // namespace sqslam
