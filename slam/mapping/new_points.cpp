#include "slam/mapping/new_points.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "slam/estimation/reprojection_error.h"
#include "slam/estimation/two_view.h"
#include "slam/features/matching.h"
#include "slam/geometry/lie.h"
#include "slam/util/statistics.h"

namespace sqslam {
namespace {

double MedianDepth(const Map& map, const Keyframe& keyframe) {
  std::vector<double> depths;
  for (const PointId point : keyframe.points) {
    if (point != kNoPoint) {
      depths.push_back((keyframe.T_camera_map * map.Point(point).p_map).z());
    }
  }
  if (depths.empty()) {
    return std::numeric_limits<double>::infinity();
  }
  return UpperMedian(std::move(depths));
}

// F with pixel2^T F pixel1 = 0.
Eigen::Matrix3d FundamentalMatrix(const Camera& camera, const Keyframe& keyframe1,
                                  const Keyframe& keyframe2) {
  const Rigid3d T_2_1 = keyframe2.T_camera_map * keyframe1.T_camera_map.Inverse();
  Eigen::Matrix3d K;
  K << camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0;
  const Eigen::Matrix3d K_inverse = K.inverse();
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

// Pairs of free keypoints of two keyframes whose descriptors agree on the epipolar line.
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
    const Keypoint& keypoint1 = keyframe1.features->keypoints[static_cast<std::size_t>(i)];
    const Descriptor& descriptor1 = keyframe1.features->descriptors[static_cast<std::size_t>(i)];
    const Eigen::Vector3d line = F * keypoint1.pixel.homogeneous();
    const double inverse_norm2 = 1.0 / line.head<2>().squaredNorm();
    int best = kStrictDistance + 1;
    int best_j = -1;
    for (const int j : free2) {
      const Keypoint& keypoint2 = keyframe2.features->keypoints[static_cast<std::size_t>(j)];
      const double d = line.x() * keypoint2.pixel.x() + line.y() * keypoint2.pixel.y() + line.z();
      const double variance = map.Levels().Variance(keypoint2.octave);
      if (d * d * inverse_norm2 > kChi2OneDof * variance || taken[static_cast<std::size_t>(j)] ||
          (has_epipole && (epipole - keypoint2.pixel).squaredNorm() <
                              kEpipoleRadius * kEpipoleRadius * map.Levels().Scale(keypoint2.octave))) {
        continue;
      }
      const int distance =
          HammingDistance(descriptor1, keyframe2.features->descriptors[static_cast<std::size_t>(j)]);
      if (distance < best) {
        best = distance;
        best_j = j;
      }
    }
    if (best_j >= 0) {
      taken[static_cast<std::size_t>(best_j)] = true;
      matches.emplace_back(i, best_j);
      angles.emplace_back(keypoint1.angle,
                          keyframe2.features->keypoints[static_cast<std::size_t>(best_j)].angle);
    }
  }
  std::vector<std::pair<int, int>> kept;
  for (const int i : ConsistentRotations(angles)) {
    kept.push_back(matches[static_cast<std::size_t>(i)]);
  }
  return kept;
}

bool Reprojects(const Map& map, const Camera& camera, const Keyframe& keyframe, const Keypoint& keypoint,
                const Eigen::Vector3d& p_map) {
  const Eigen::Vector3d p_camera = keyframe.T_camera_map * p_map;
  return p_camera.z() > 0.0 && (camera.Project(p_camera) - keypoint.pixel).squaredNorm() <=
                                   kChi2TwoDof * map.Levels().Variance(keypoint.octave);
}

bool IsGoodPoint(const Map& map, const Camera& camera, const Keyframe& keyframe1, const Keypoint& keypoint1,
                 const Keyframe& keyframe2, const Keypoint& keypoint2, const Eigen::Vector3d& p_map,
                 const NewPointOptions& options) {
  if (!p_map.allFinite() ||
      CosParallax(p_map, keyframe1.Center(), keyframe2.Center()) > options.max_parallax_cos ||
      !Reprojects(map, camera, keyframe1, keypoint1, p_map) ||
      !Reprojects(map, camera, keyframe2, keypoint2, p_map)) {
    return false;
  }
  // A patch twice as far away should be found two times smaller.
  const double distance_ratio = (p_map - keyframe2.Center()).norm() / (p_map - keyframe1.Center()).norm();
  const double octave_ratio = map.Levels().Scale(keypoint1.octave) / map.Levels().Scale(keypoint2.octave);
  const double slack = options.ratio_factor * map.Levels().Factor();
  return distance_ratio < octave_ratio * slack && distance_ratio * slack > octave_ratio;
}

}  // namespace

std::vector<PointId> CreateNewPoints(Map& map, const Camera& camera, KeyframeId id,
                                     const NewPointOptions& options) {
  std::vector<PointId> created;
  for (const KeyframeId neighbour_id : map.At(id).BestCovisible(options.neighbours)) {
    const Keyframe& keyframe = map.At(id);
    const Keyframe& neighbour = map.At(neighbour_id);
    const double baseline = (keyframe.Center() - neighbour.Center()).norm();
    if (baseline < options.min_baseline * MedianDepth(map, neighbour)) {
      continue;
    }
    for (const auto& [i, j] : MatchAlongEpipolarLines(map, camera, keyframe, neighbour)) {
      const Keypoint& keypoint1 = keyframe.features->keypoints[static_cast<std::size_t>(i)];
      const Keypoint& keypoint2 = neighbour.features->keypoints[static_cast<std::size_t>(j)];
      const Eigen::Vector3d p_map = Triangulate(keyframe.T_camera_map, camera.Unproject(keypoint1.pixel),
                                                neighbour.T_camera_map, camera.Unproject(keypoint2.pixel));
      if (!IsGoodPoint(map, camera, keyframe, keypoint1, neighbour, keypoint2, p_map, options)) {
        continue;
      }
      const PointId point = map.AddPoint(p_map, id);
      map.AddObservation(point, id, i);
      map.AddObservation(point, neighbour_id, j);
      map.UpdateAppearance(point);
      created.push_back(point);
    }
  }
  return created;
}

}  // namespace sqslam
