#include "slam/objects/point_evidence.h"

#include <cmath>

namespace sqslam {

std::unordered_map<std::int64_t, int> OwnersOfPoints(std::span<const Landmark* const> landmarks) {
  std::unordered_map<std::int64_t, int> owners;
  std::unordered_map<std::int64_t, double> distances;
  for (const Landmark* landmark : landmarks) {
    const Rigid3d T_object_map = landmark->superquadric.T_map_object.Inverse();
    for (const auto& [point, p] : landmark->points) {
      const double distance = std::abs(landmark->superquadric.shape.RadialDistance(T_object_map * p));
      const auto [it, is_new] = distances.emplace(point, distance);
      if (is_new || distance < it->second) {
        it->second = distance;
        owners[point] = landmark->id;
      }
    }
  }
  return owners;
}

std::unordered_map<std::int64_t, PointEvidence> EvidenceOfPoints(std::span<const Landmark* const> landmarks) {
  std::unordered_map<std::int64_t, PointEvidence> evidence;
  for (const auto& [point, id] : OwnersOfPoints(landmarks)) {
    evidence[point].object_id = id;
  }
  std::unordered_map<std::int64_t, int> sightings;  // in the boxes of the object that rejected the point
  for (const Landmark* landmark : landmarks) {
    for (const PointVerdict& verdict : landmark->verdicts) {
      PointEvidence& of_point = evidence[verdict.point];
      if (verdict.kept) {
        of_point.anomaly = of_point.object_id == landmark->id ? verdict.anomaly : of_point.anomaly;
      } else if (verdict.sightings > sightings[verdict.point]) {
        sightings[verdict.point] = verdict.sightings;
        of_point.rejected_by = landmark->id;
        of_point.anomaly = of_point.object_id < 0 ? verdict.anomaly : of_point.anomaly;
      }
    }
  }
  return evidence;
}

}  // namespace sqslam
