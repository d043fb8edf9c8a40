#include "slam/evaluation/trajectory_error.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "slam/geometry/similarity_alignment.h"
#include "slam/util/statistics.h"

namespace sqslam {
namespace {

Trajectory KeyframesOf(const MapSnapshot& map) {
  Trajectory keyframes = KeyframeTrajectory(map);
  std::ranges::sort(keyframes,  // merged maps are not in order of time
                    [](const TimedPose& a, const TimedPose& b) { return a.timestamp < b.timestamp; });
  return keyframes;
}

}  // namespace

std::vector<std::pair<std::size_t, std::size_t>> AssociateByTime(const Trajectory& estimated,
                                                                 const Trajectory& truth,
                                                                 double max_time_difference) {
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  std::size_t j = 0;
  const auto difference = [&](std::size_t estimate, std::size_t index) {
    return std::abs(estimated[estimate].timestamp - truth[index].timestamp);
  };
  for (std::size_t i = 0; i < estimated.size() && !truth.empty(); ++i) {
    while (j + 1 < truth.size() && difference(i, j + 1) <= difference(i, j)) {
      ++j;
    }
    if (difference(i, j) > max_time_difference) {
      continue;
    }
    if (pairs.empty() || pairs.back().second != j) {
      pairs.emplace_back(i, j);
    } else if (difference(i, j) < difference(pairs.back().first, j)) {
      pairs.back().first = i;  // the nearer of two estimates gets the pose
    }
  }
  return pairs;
}

std::optional<TrajectoryError> ComputeTrajectoryError(const Trajectory& estimated, const Trajectory& truth,
                                                      double max_time_difference, Alignment alignment) {
  const auto pairs = AssociateByTime(estimated, truth, max_time_difference);
  std::vector<Eigen::Vector3d> map_positions;
  std::vector<Eigen::Vector3d> world_positions;
  for (const auto& [i, j] : pairs) {
    map_positions.push_back(estimated[i].T_map_camera.translation);
    world_positions.push_back(truth[j].T_map_camera.translation);
  }
  const auto S_world_map = AlignSimilarity(map_positions, world_positions);
  if (!S_world_map) {
    return std::nullopt;
  }
  TrajectoryError error;
  error.S_world_map = *S_world_map;
  if (alignment == Alignment::kPoses) {
    std::vector<Rigid3d> map_poses, world_poses;
    for (const auto& [i, j] : pairs) {
      map_poses.push_back(estimated[i].T_map_camera);
      world_poses.push_back(truth[j].T_map_camera);
    }
    error.S_world_map = AlignPoses(map_poses, world_poses).value_or(*S_world_map);
  }
  error.pairs = static_cast<int>(pairs.size());
  std::vector<double> distances;
  double squares = 0.0;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    distances.push_back((*S_world_map * map_positions[k] - world_positions[k]).norm());
    squares += distances.back() * distances.back();
  }
  const auto count = static_cast<double>(distances.size());
  std::ranges::sort(distances);
  error.rmse = std::sqrt(squares / count);
  error.mean = std::accumulate(distances.begin(), distances.end(), 0.0) / count;
  error.median = distances[distances.size() / 2];
  error.max = distances.back();
  for (std::size_t j = pairs.front().second; j < pairs.back().second; ++j) {
    error.path_length += (truth[j + 1].T_map_camera.translation - truth[j].T_map_camera.translation).norm();
  }
  return error;
}

std::vector<Trajectory> SplitAtGaps(const Trajectory& trajectory) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < trajectory.size(); ++i) {
    steps.push_back(trajectory[i].timestamp - trajectory[i - 1].timestamp);
  }
  const double longest = steps.empty() ? 0.0 : 5.0 * UpperMedian(steps) + 1e-9;
  std::vector<Trajectory> pieces;
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    if (i == 0 || steps[i - 1] > longest) {
      pieces.emplace_back();
    }
    pieces.back().push_back(trajectory[i]);
  }
  return pieces;
}

std::optional<TruePath> AlignTruePath(const Trajectory& truth, const MapSnapshot& map,
                                      double max_time_difference) {
  const Trajectory keyframes = KeyframesOf(map);
  const std::optional<TrajectoryError> error = ComputeTrajectoryError(keyframes, truth, max_time_difference);
  if (!error) {
    return std::nullopt;
  }
  TruePath path{*error, {}};
  const Sim3d S_map_world = error->S_world_map.Inverse();
  const double begin = keyframes.front().timestamp - max_time_difference;
  const double end = std::max(keyframes.back().timestamp, map.timestamp) + max_time_difference;
  for (const Trajectory& piece : SplitAtGaps(truth)) {
    std::vector<Eigen::Vector3d> shown;
    for (const TimedPose& pose : piece) {
      if (pose.timestamp >= begin && pose.timestamp <= end) {
        shown.push_back(S_map_world * pose.T_map_camera.translation);
      }
    }
    if (!shown.empty()) {
      path.pieces.push_back(std::move(shown));
    }
  }
  return path;
}

}  // namespace sqslam
