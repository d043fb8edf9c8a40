#include "slam/mapping/fusion.h"

#include <limits>
#include <set>

#include "slam/estimation/pose_optimization.h"
#include "slam/features/matching.h"

namespace sqslam {
namespace {

std::set<KeyframeId> Neighbourhood(const Map& map, KeyframeId id, const FusionOptions& options) {
  std::set<KeyframeId> neighbourhood;
  for (const KeyframeId near : map.At(id).BestCovisible(options.neighbours)) {
    neighbourhood.insert(near);
    for (const KeyframeId further : map.At(near).BestCovisible(options.second_neighbours)) {
      neighbourhood.insert(further);
    }
  }
  neighbourhood.erase(id);
  return neighbourhood;
}

bool Observes(const MapPoint& point, KeyframeId keyframe) {
  for (const Observation& o : point.observations) {
    if (o.keyframe == keyframe) {
      return true;
    }
  }
  return false;
}

// The keypoint of the keyframe that shows the point, or -1.
int FindKeypoint(const Map& map, const Camera& camera, const Keyframe& keyframe, const MapPoint& point,
                 double level_zero_radius) {
  constexpr double kMinViewCosine = 0.5;
  const Eigen::Vector3d p_camera = keyframe.T_camera_map * point.p_map;
  if (p_camera.z() <= 0.0) {
    return -1;
  }
  const Eigen::Vector2d pixel = camera.Project(p_camera);
  const Eigen::Vector3d ray = point.p_map - keyframe.Center();
  const double distance = ray.norm();
  if (pixel.x() < 0.0 || pixel.y() < 0.0 || pixel.x() >= camera.width || pixel.y() >= camera.height ||
      distance < point.min_distance || distance > point.max_distance ||
      ray.dot(point.normal) < kMinViewCosine * distance) {
    return -1;
  }
  const int octave = map.Levels().PredictOctave(distance, point.max_distance);
  const double radius = level_zero_radius * map.Levels().Scale(octave);
  int best = kStrictDistance + 1;
  int best_keypoint = -1;
  keyframe.features->grid.ForEachNear(pixel, radius, [&](int index) {
    const auto i = static_cast<std::size_t>(index);
    const Keypoint& keypoint = keyframe.features->keypoints[i];
    const double squared = (keypoint.pixel - pixel).squaredNorm();
    if (keypoint.octave < octave - 1 || keypoint.octave > octave || squared > radius * radius ||
        squared > kChi2TwoDof * map.Levels().Variance(keypoint.octave)) {
      return;
    }
    const int bits = HammingDistance(point.descriptor, keyframe.features->descriptors[i]);
    if (bits < best) {
      best = bits;
      best_keypoint = index;
    }
  });
  return best_keypoint;
}

int FuseInto(Map& map, const Camera& camera, const std::set<PointId>& points, KeyframeId keyframe,
             double radius) {
  int fused = 0;
  for (const PointId id : points) {
    if (!map.IsAlive(id) || Observes(map.Point(id), keyframe)) {
      continue;
    }
    const int keypoint = FindKeypoint(map, camera, map.At(keyframe), map.Point(id), radius);
    if (keypoint < 0) {
      continue;
    }
    ++fused;
    const PointId present = map.At(keyframe).points[static_cast<std::size_t>(keypoint)];
    if (present == kNoPoint) {
      map.AddObservation(id, keyframe, keypoint);
    } else if (map.Point(present).observations.size() > map.Point(id).observations.size()) {
      map.Fuse(id, present);
    } else {
      map.Fuse(present, id);
    }
  }
  return fused;
}

std::set<PointId> PointsOf(const Map& map, KeyframeId keyframe) {
  std::set<PointId> points;
  for (const PointId point : map.At(keyframe).points) {
    if (point != kNoPoint) {
      points.insert(point);
    }
  }
  return points;
}

}  // namespace

int FuseWithNeighbours(Map& map, const Camera& camera, KeyframeId id, const FusionOptions& options) {
  const std::set<KeyframeId> neighbourhood = Neighbourhood(map, id, options);
  int fused = 0;
  std::set<PointId> theirs;
  for (const KeyframeId neighbour : neighbourhood) {
    fused += FuseInto(map, camera, PointsOf(map, id), neighbour, options.radius);
    theirs.merge(PointsOf(map, neighbour));
  }
  fused += FuseInto(map, camera, theirs, id, options.radius);
  for (const PointId point : PointsOf(map, id)) {
    map.UpdateAppearance(point);
  }
  map.UpdateCovisibility(id);
  return fused;
}

}  // namespace sqslam
