#include "slam/mapping/fusion.h"

#include <algorithm>

#include "slam/estimation/reprojection_error.h"
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

}  // namespace

int FindKeypoint(const ScaleLevels& levels, const Camera& camera, const Rigid3d& T_camera_map,
                 const FrameFeatures& features, const MapPoint& point, const ProjectionSearch& search) {
  const std::optional<PredictedSight> sight =
      PredictSight(point, camera, T_camera_map, T_camera_map.Inverse().translation);
  if (!sight) {
    return -1;
  }
  const int octave = levels.PredictOctave(sight->distance, point.level_zero_distance);
  const double radius = search.radius * levels.Scale(octave);
  int best = search.max_distance + 1;
  int best_keypoint = -1;
  features.grid.ForEachNear(sight->pixel, radius, [&](int index) {
    const auto i = static_cast<std::size_t>(index);
    const Keypoint& keypoint = features.keypoints[i];
    const double squared = (keypoint.pixel - sight->pixel).squaredNorm();
    if (std::abs(keypoint.octave - octave) > 1 || squared > radius * radius ||
        squared > search.max_squared_error * levels.Variance(keypoint.octave)) {
      return;
    }
    const int bits = HammingDistance(point.descriptor, features.descriptors[i]);
    if (bits < best) {
      best = bits;
      best_keypoint = index;
    }
  });
  return best_keypoint;
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

int FuseInto(Map& map, const Camera& camera, const std::set<PointId>& points, KeyframeId id,
             const ProjectionSearch& search) {
  int fused = 0;
  for (const PointId point : points) {
    if (!map.IsAlive(point) || map.Point(point).IsSeenBy(id)) {
      continue;
    }
    const Keyframe& keyframe = map.At(id);
    const int keypoint = FindKeypoint(map.Levels(), camera, keyframe.T_camera_map, *keyframe.features,
                                      map.Point(point), search);
    if (keypoint < 0) {
      continue;
    }
    ++fused;
    const PointId present = keyframe.points[static_cast<std::size_t>(keypoint)];
    if (present == kNoPoint) {
      map.AddObservation(point, id, keypoint);
    } else if (map.Point(present).observations.size() > map.Point(point).observations.size()) {
      map.Fuse(point, present);
    } else {
      map.Fuse(present, point);
    }
  }
  return fused;
}

int FuseWithNeighbours(Map& map, const Camera& camera, KeyframeId id, const FusionOptions& options) {
  const std::set<KeyframeId> neighbourhood = Neighbourhood(map, id, options);
  ProjectionSearch search;
  search.radius = options.radius;
  search.max_squared_error = kChi2TwoDof;
  int fused = 0;
  std::set<PointId> theirs;
  for (const KeyframeId neighbour : neighbourhood) {
    fused += FuseInto(map, camera, PointsOf(map, id), neighbour, search);
    theirs.merge(PointsOf(map, neighbour));
  }
  fused += FuseInto(map, camera, theirs, id, search);
  for (const PointId point : PointsOf(map, id)) {
    map.UpdateAppearance(point);
  }
  map.UpdateCovisibility(id);
  return fused;
}

}  // namespace sqslam
