#include "slam/mapping/upright.h"

#include <cmath>
#include <cstdio>
#include <numbers>
#include <ranges>
#include <vector>

#include "slam/objects/vertical_lines.h"
#include "slam/util/error.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

std::optional<Eigen::Vector3d> ParseGravity(const std::string& text) {
  if (text == "auto") {
    return std::nullopt;
  }
  if (text == "level-start") {
    return -Eigen::Vector3d::UnitY();
  }
  Eigen::Vector3d gravity;
  char end = 0;
  if (std::sscanf(text.c_str(), " [ %lf , %lf , %lf %c", &gravity.x(), &gravity.y(), &gravity.z(), &end) !=
          4 ||
      end != ']' || !gravity.allFinite() || gravity.norm() < 1e-9) {
    throw UsageError("gravity: expected auto, level-start or [x, y, z], not '{}'", text);
  }
  return -gravity.normalized();
}

std::vector<Eigen::Vector3d> ReliablePoints(const Map& map) {
  std::vector<Eigen::Vector3d> points;
  for (const MapPoint& point : map.Points()) {
    if (point.observations.size() >= 3) {
      points.push_back(point.p_map);
    }
  }
  return points;
}

std::vector<std::vector<Eigen::Vector3d>> ObjectPoints(std::span<const ObjectLandmarkView> objects) {
  std::vector<std::vector<Eigen::Vector3d>> sets;
  for (const ObjectLandmarkView& object : objects) {
    auto& set = sets.emplace_back();
    for (const auto& [id, p_map] : object.points) {
      set.push_back(p_map);
    }
  }
  return sets;
}

}  // namespace

UprightEstimator::UprightEstimator(const std::string& gravity, const GravityOptions& options,
                                   std::uint64_t seed)
    : given_up_(ParseGravity(gravity)), options_(options), seed_(seed) {}

std::optional<Rigid3d> UprightEstimator::Update(const Map& map, const ObjectMapper& objects,
                                                const Camera& camera, bool last) {
  if (!given_up_) {
    return UpdateFromMap(map, objects, camera, last);
  }
  support_height_ =
      EstimateSupportHeight(ReliablePoints(map), ObjectPoints(objects.View()->landmarks), options_);
  if (known_) {
    return std::nullopt;
  }
  known_ = true;
  return UprightTransform(*given_up_);
}

std::optional<Rigid3d> UprightEstimator::UpdateFromMap(const Map& map, const ObjectMapper& objects,
                                                       const Camera& camera, bool last) {
  constexpr KeyframeId kEager = 12;  // the first keyframes that are all used;
  constexpr KeyframeId kPeriod = 5;  // later, one in this many
  constexpr double kSmallestTurn = 0.2 * std::numbers::pi / 180.0;
  constexpr double kLosesTo = 0.8;  // a later estimate needs this share of the best evidence so far
  const KeyframeId newest = map.NewestKeyframe() - map.OldestKeyframe();
  if (!last && known_ && newest > kEager && newest % kPeriod != 0) {
    return std::nullopt;
  }
  const std::vector<Rigid3d> poses = ToVector(map.Keyframes() | std::views::values, [](const auto& keyframe) {
    return keyframe.T_camera_map.Inverse();
  });
  const std::optional<SupportPlane> plane = FindPlane(map, poses, objects, camera);
  if (!plane) {
    return std::nullopt;
  }
  // A few points on a small plane are soon all inliers: by confidence alone an early estimate would never be
  // replaced.
  const double evidence = plane->confidence * std::sqrt(static_cast<double>(plane->inliers));
  if (evidence < kLosesTo * evidence_) {
    return std::nullopt;
  }
  evidence_ = std::max(evidence_, evidence);
  support_height_ = plane->height;
  const double turn = std::acos(std::clamp(plane->up.z(), -1.0, 1.0));
  if (known_ && turn < kSmallestTurn) {
    return std::nullopt;
  }
  known_ = true;
  return UprightTransform(plane->up);
}

std::optional<SupportPlane> UprightEstimator::FindPlane(const Map& map, std::span<const Rigid3d> poses,
                                                        const ObjectMapper& objects,
                                                        const Camera& camera) const {
  constexpr double kClearly = 5.0;      // a log likelihood ratio
  constexpr double kAcrossThem = 0.05;  // radians
  const std::vector<Eigen::Vector3d> points = ReliablePoints(map);
  const auto object_points = ObjectPoints(objects.View()->landmarks);
  const auto find = [&](const std::optional<Eigen::Vector3d>& vertical) {
    return EstimateSupportPlane(points, poses, object_points, options_, seed_, vertical);
  };
  const std::optional<SupportPlane> plane = find({});
  if (!plane && !known_) {
    return std::nullopt;
  }
  // The best plane may lean across tops of different heights, or be that of a ramp. Edges tell, but less
  // exactly than a plane that is level.
  const auto edges = VerticalFromLines(objects.Lines(), camera, plane ? plane->up : Eigen::Vector3d::UnitZ());
  if (!edges || edges->gain < kClearly) {
    return plane;
  }
  const auto level = plane ? find(edges->up) : std::nullopt;
  if (level && (level->up - edges->up).norm() < kAcrossThem) {
    return level;
  }
  const Rigid3d T_upright_map = UprightTransform(edges->up);
  const auto height = EstimateSupportHeight(
      ToVector(points, [&](const Eigen::Vector3d& p) { return T_upright_map * p; }), {}, options_);
  // Counts as much as the plane that it replaces, or as the best so far.
  SupportPlane across = plane.value_or(SupportPlane{.confidence = evidence_, .inliers = 1});
  across.up = edges->up;
  across.height = height.value_or(support_height_.value_or(0.0));
  return across;
}

SupportSurfaces UprightEstimator::FindSurfaces(const Map& map) const {
  return known_ ? SupportSurfaces::Find(ReliablePoints(map), options_) : SupportSurfaces();
}

}  // namespace sqslam
