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
    throw UsageError("gravity: '{}', expected auto, level-start or a direction [x, y, z] in the first camera",
                     text);
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
  constexpr KeyframeId kYoungMap = 12;  // keyframes up to which each one gives an estimate
  constexpr KeyframeId kInterval = 5;   // keyframes between later estimates
  constexpr double kMinTurn = 0.2 * std::numbers::pi / 180.0;
  constexpr double kMinEvidenceShare = 0.8;  // of the best evidence so far, for a later estimate
  const KeyframeId newest = map.NewestKeyframe() - map.OldestKeyframe();
  if (!last && known_ && newest > kYoungMap && newest % kInterval != 0) {
    return std::nullopt;
  }
  const std::vector<Rigid3d> poses = ToVector(map.Keyframes() | std::views::values, [](const auto& keyframe) {
    return keyframe.T_camera_map.Inverse();
  });
  const std::optional<SupportPlane> plane = FindPlane(map, poses, objects, camera);
  if (!plane) {
    return std::nullopt;
  }
  // The few points of an early map are easily all inliers: by confidence alone, an early estimate would never
  // be replaced.
  const double evidence = plane->confidence * std::sqrt(static_cast<double>(plane->inliers));
  if (evidence < kMinEvidenceShare * evidence_) {
    return std::nullopt;
  }
  evidence_ = std::max(evidence_, evidence);
  support_height_ = plane->height;
  const double turn = std::acos(std::clamp(plane->up.z(), -1.0, 1.0));
  if (known_ && turn < kMinTurn) {
    return std::nullopt;
  }
  known_ = true;
  return UprightTransform(plane->up);
}

std::optional<SupportPlane> UprightEstimator::FindPlane(const Map& map, std::span<const Rigid3d> poses,
                                                        const ObjectMapper& objects,
                                                        const Camera& camera) const {
  constexpr double kMinGain = 5.0;        // log likelihood ratio of the edges' direction
  constexpr double kMaxDeviation = 0.05;  // radians, of a level plane from that direction
  const std::vector<Eigen::Vector3d> points = ReliablePoints(map);
  const auto object_points = ObjectPoints(objects.View()->landmarks);
  const auto find = [&](const std::optional<Eigen::Vector3d>& vertical) {
    return EstimateSupportPlane(points, poses, object_points, options_, seed_, vertical);
  };
  const std::optional<SupportPlane> plane = find({});
  if (!plane && !known_) {
    return std::nullopt;
  }
  // The best plane may lean across tops of different heights, or be a ramp. Vertical edges reveal this, but
  // are less exact than a level plane.
  const auto edges = VerticalFromLines(objects.Lines(), camera, plane ? plane->up : Eigen::Vector3d::UnitZ());
  if (!edges || edges->gain < kMinGain) {
    return plane;
  }
  const auto level = plane ? find(edges->up) : std::nullopt;
  if (level && (level->up - edges->up).norm() < kMaxDeviation) {
    return level;
  }
  const Rigid3d T_upright_map = UprightTransform(edges->up);
  const auto height = EstimateSupportHeight(
      ToVector(points, [&](const Eigen::Vector3d& p) { return T_upright_map * p; }), {}, options_);
  // The new plane gets the evidence of the plane that it replaces, or the best so far.
  SupportPlane across = plane.value_or(SupportPlane{.confidence = evidence_, .inliers = 1});
  across.up = edges->up;
  across.height = height.value_or(support_height_.value_or(0.0));
  return across;
}

SupportSurfaces UprightEstimator::FindSurfaces(const Map& map) const {
  return known_ ? SupportSurfaces::Find(ReliablePoints(map), options_) : SupportSurfaces();
}

}  // namespace sqslam
