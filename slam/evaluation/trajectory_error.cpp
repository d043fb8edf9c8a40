#include "slam/evaluation/trajectory_error.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "slam/geometry/similarity_alignment.h"

namespace sqslam {

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
      pairs.back().first = i;  // two estimates want one pose: the nearer has it
    }
  }
  return pairs;
}

std::optional<TrajectoryError> ComputeTrajectoryError(const Trajectory& estimated, const Trajectory& truth,
                                                      double max_time_difference) {
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
  error.pairs = static_cast<int>(pairs.size());
  std::vector<double> distances;
  double squares = 0.0;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    distances.push_back((*S_world_map * map_positions[k] - world_positions[k]).norm());
    squares += distances.back() * distances.back();
  }
  const auto count = static_cast<double>(distances.size());
  std::sort(distances.begin(), distances.end());
  error.rmse = std::sqrt(squares / count);
  error.mean = std::accumulate(distances.begin(), distances.end(), 0.0) / count;
  error.median = distances[distances.size() / 2];
  error.max = distances.back();
  for (std::size_t j = pairs.front().second; j < pairs.back().second; ++j) {
    error.path_length += (truth[j + 1].T_map_camera.translation - truth[j].T_map_camera.translation).norm();
  }
  return error;
}

}  // namespace sqslam
