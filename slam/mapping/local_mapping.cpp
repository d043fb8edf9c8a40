#include "slam/mapping/local_mapping.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <iterator>

#include "slam/estimation/reprojection_error.h"
#include "slam/estimation/two_view.h"
#include "slam/features/matching.h"
#include "slam/geometry/lie.h"
#include "slam/util/statistics.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

std::set<KeyframeId> Neighbourhood(const Map& map, KeyframeId id, const FusionOptions& options) {
  constexpr int kNeighbours = 15;  // covisible keyframes whose points are fused
  std::set<KeyframeId> neighbourhood;
  for (const KeyframeId near : map.At(id).BestCovisible(kNeighbours)) {
    neighbourhood.insert(near);
    for (const KeyframeId further : map.At(near).BestCovisible(options.second_neighbours)) {
      neighbourhood.insert(further);
    }
  }
  neighbourhood.erase(id);
  return neighbourhood;
}

double MedianDepth(const Map& map, const Keyframe& keyframe) {
  std::vector<double> depths = ToVector(keyframe.SeenPoints(), [&](const PointId point) {
    return (keyframe.T_camera_map * map.Point(point).p_map).z();
  });
  return depths.empty() ? std::numeric_limits<double>::infinity() : UpperMedian(std::move(depths));
}

// F with pixel2^T F pixel1 = 0.
Eigen::Matrix3d FundamentalMatrix(const Camera& camera, const Keyframe& keyframe1,
                                  const Keyframe& keyframe2) {
  const Rigid3d T_2_1 = keyframe2.T_camera_map * keyframe1.T_camera_map.Inverse();
  const Eigen::Matrix3d K_inverse = camera.K().inverse();
  return K_inverse.transpose() * Skew(T_2_1.translation) * T_2_1.RotationMatrix() * K_inverse;
}

std::vector<int> FreeKeypoints(const Keyframe& keyframe) {
  std::vector<int> free;
  for (std::size_t i = 0; i < keyframe.points.size(); ++i) {
    if (keyframe.points[i] == kNoPoint) {
      free.push_back(static_cast<int>(i));
    }
  }
  return free;
}

// Pairs of keypoints without a map point whose descriptors agree along the epipolar line.
std::vector<std::pair<int, int>> MatchAlongEpipolarLines(const Map& map, const Camera& camera,
                                                         const Keyframe& keyframe1,
                                                         const Keyframe& keyframe2) {
  constexpr double kEpipoleRadius = 10.0;  // px at level 0: near the epipole the depth is not observable
  const Eigen::Matrix3d F = FundamentalMatrix(camera, keyframe1, keyframe2);
  const Eigen::Vector3d epipole_camera = keyframe2.T_camera_map * keyframe1.Center();
  const bool has_epipole = epipole_camera.z() > 0.0;
  const Eigen::Vector2d epipole = has_epipole ? camera.Project(epipole_camera) : Eigen::Vector2d::Zero();
  const std::vector<int> free2 = FreeKeypoints(keyframe2);
  std::vector<bool> taken(keyframe2.points.size(), false);
  std::vector<std::pair<int, int>> matches;
  std::vector<std::pair<float, float>> angles;
  for (const int i : FreeKeypoints(keyframe1)) {
    const Keypoint& keypoint1 = keyframe1.features->keypoints[i];
    const Descriptor& descriptor1 = keyframe1.features->descriptors[i];
    const Eigen::Vector3d line = F * keypoint1.pixel.homogeneous();
    const double inverse_norm2 = 1.0 / line.head<2>().squaredNorm();
    NearestTwo nearest;
    for (const int j : free2) {
      const Keypoint& keypoint2 = keyframe2.features->keypoints[j];
      const double d = line.x() * keypoint2.pixel.x() + line.y() * keypoint2.pixel.y() + line.z();
      const double variance = map.Levels().Variance(keypoint2.octave);
      if (d * d * inverse_norm2 > kChi2OneDof * variance || taken[j] ||
          (has_epipole && (epipole - keypoint2.pixel).squaredNorm() <
                              kEpipoleRadius * kEpipoleRadius * map.Levels().Scale(keypoint2.octave))) {
        continue;
      }
      nearest.Add(HammingDistance(descriptor1, keyframe2.features->descriptors[j]), j);
    }
    if (const int j = nearest.best.index; nearest.best.distance <= kMaxUnguidedDistance) {
      taken[j] = true;
      matches.emplace_back(i, j);
      angles.emplace_back(keypoint1.angle, keyframe2.features->keypoints[j].angle);
    }
  }
  return KeepConsistent(matches, angles);
}

bool Reprojects(const Map& map, const Camera& camera, const Keyframe& keyframe, const Keypoint& keypoint,
                const Eigen::Vector3d& p_map) {
  return SquaredError(camera, keyframe.T_camera_map * p_map, keypoint.pixel,
                      map.Levels().Variance(keypoint.octave)) <= kChi2TwoDof;
}

bool IsGoodPoint(const Map& map, const Camera& camera, const Keyframe& keyframe1, const Keypoint& keypoint1,
                 const Keyframe& keyframe2, const Keypoint& keypoint2, const Eigen::Vector3d& p_map,
                 double max_parallax_cos) {
  constexpr double kMaxScaleRatio = 1.5;  // slack of the scale consistency test, in pyramid factors
  if (!p_map.allFinite() || CosParallax(p_map, keyframe1.Center(), keyframe2.Center()) > max_parallax_cos ||
      !Reprojects(map, camera, keyframe1, keypoint1, p_map) ||
      !Reprojects(map, camera, keyframe2, keypoint2, p_map)) {
    return false;
  }
  // A patch twice as far away should be found two times smaller.
  const double distance_ratio = (p_map - keyframe2.Center()).norm() / (p_map - keyframe1.Center()).norm();
  const double octave_ratio = map.Levels().Scale(keypoint1.octave) / map.Levels().Scale(keypoint2.octave);
  const double slack = kMaxScaleRatio * map.Levels().Factor();
  return distance_ratio < octave_ratio * slack && distance_ratio * slack > octave_ratio;
}

bool IsRedundant(const Map& map, const Keyframe& keyframe, const CullingOptions& options) {
  int points = 0;
  int redundant = 0;
  for (std::size_t i = 0; i < keyframe.points.size(); ++i) {
    if (keyframe.points[i] == kNoPoint) {
      continue;
    }
    ++points;
    const int octave = keyframe.features->keypoints[i].octave;
    const auto others =
        std::ranges::count_if(map.Point(keyframe.points[i]).observations, [&](const Observation& o) {
          return o.keyframe != keyframe.id && map.KeypointOf(o).octave <= octave + 1;
        });
    redundant += others >= options.redundant_observations ? 1 : 0;
  }
  return redundant > options.redundant_share * points;
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
  NearestTwo nearest;
  features.grid.ForEachNear(sight->pixel, radius, [&](int i) {
    const Keypoint& keypoint = features.keypoints[i];
    const double squared = (keypoint.pixel - sight->pixel).squaredNorm();
    if (std::abs(keypoint.octave - octave) <= 1 && squared <= radius * radius &&
        squared <= search.max_squared_error * levels.Variance(keypoint.octave)) {
      nearest.Add(HammingDistance(point.descriptor, features.descriptors[i]), i);
    }
  });
  return nearest.best.distance <= search.max_distance ? nearest.best.index : -1;
}

std::set<PointId> PointsOf(const Map& map, KeyframeId keyframe) {
  auto points = map.At(keyframe).SeenPoints();
  return {points.begin(), points.end()};
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
    const PointId present = keyframe.points[keypoint];
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

std::vector<PointId> CreatePoints(Map& map, const Camera& camera, KeyframeId id, KeyframeId neighbour_id,
                                  const std::vector<std::pair<int, int>>& matches,
                                  const NewPointOptions& options) {
  const Keyframe& keyframe = map.At(id);
  const Keyframe& neighbour = map.At(neighbour_id);
  std::vector<PointId> created;
  for (const auto& [i, j] : matches) {
    if (keyframe.points[i] != kNoPoint || neighbour.points[j] != kNoPoint) {
      continue;
    }
    const Keypoint& keypoint1 = keyframe.features->keypoints[i];
    const Keypoint& keypoint2 = neighbour.features->keypoints[j];
    const Eigen::Vector3d p_map = Triangulate(keyframe.T_camera_map, camera.Unproject(keypoint1.pixel),
                                              neighbour.T_camera_map, camera.Unproject(keypoint2.pixel));
    if (!IsGoodPoint(map, camera, keyframe, keypoint1, neighbour, keypoint2, p_map,
                     options.max_parallax_cos)) {
      continue;
    }
    const PointId point = map.AddPoint(p_map, id);
    map.AddObservation(point, id, i);
    map.AddObservation(point, neighbour_id, j);
    map.UpdateAppearance(point);
    created.push_back(point);
  }
  return created;
}

std::vector<PointId> CreateNewPoints(Map& map, const Camera& camera, KeyframeId id,
                                     const NewPointOptions& options) {
  constexpr double kMinBaseline = 0.01;  // distance to the neighbour, in units of its median depth
  std::vector<PointId> created;
  for (const KeyframeId neighbour_id : map.At(id).BestCovisible(options.neighbours)) {
    const Keyframe& keyframe = map.At(id);
    const Keyframe& neighbour = map.At(neighbour_id);
    const double baseline = (keyframe.Center() - neighbour.Center()).norm();
    if (baseline >= kMinBaseline * MedianDepth(map, neighbour)) {
      std::ranges::copy(CreatePoints(map, camera, id, neighbour_id,
                                     MatchAlongEpipolarLines(map, camera, keyframe, neighbour), options),
                        std::back_inserter(created));
    }
  }
  return created;
}

std::vector<PointId> AddNewPoints(Map& map, const Camera& camera, KeyframeId id) {
  std::vector<PointId> created = CreateNewPoints(map, camera, id);
  FuseWithNeighbours(map, camera, id);
  return created;
}

int CullPoints(Map& map, std::set<PointId>& young, KeyframeId newest) {
  constexpr double kMinFoundRatio = 0.25;   // of the frames that should show the point
  constexpr KeyframeId kTrialAge = 2;       // keyframes after which a point ...
  constexpr std::size_t kMinObservers = 3;  // ... needs this many keyframes that observe it
  constexpr KeyframeId kProvenAge = 3;      // keyframes after which it is no longer young
  int removed = 0;
  for (auto it = young.begin(); it != young.end();) {
    if (!map.IsAlive(*it)) {
      it = young.erase(it);
      continue;
    }
    const MapPoint& point = map.Point(*it);
    const KeyframeId age = newest - point.first_keyframe;
    const bool poor = point.FoundRatio() < kMinFoundRatio ||
                      (age >= kTrialAge && point.observations.size() < kMinObservers);
    if (poor) {
      map.RemovePoint(*it);
      ++removed;
    }
    it = poor || age >= kProvenAge ? young.erase(it) : std::next(it);
  }
  return removed;
}

std::vector<KeyframeId> CullKeyframes(Map& map, KeyframeId center, const CullingOptions& options,
                                      const LoopEdges& loop_edges) {
  std::set<KeyframeId> kept{center};
  for (const auto& [i, j] : loop_edges) {
    kept.insert({i, j});
  }
  const KeyframeId second = std::next(map.Keyframes().begin())->first;  // these two fix a young map's scale
  std::vector<KeyframeId> culled;
  for (const KeyframeId id : map.At(center).BestCovisible(static_cast<int>(map.Keyframes().size()))) {
    if (id > second && !kept.contains(id) && IsRedundant(map, map.At(id), options)) {
      map.RemoveKeyframe(id);
      culled.push_back(id);
    }
  }
  return culled;
}

}  // namespace sqslam
