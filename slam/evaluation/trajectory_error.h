#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "slam/geometry/rigid3.h"
#include "slam/io/trajectory.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

// The parts of the cameras that a similarity is fitted to: positions, or orientations too (see AlignPoses).
enum class Alignment { kPositions, kPoses };
constexpr auto EnumNames(Alignment) { return std::array{"positions", "poses"}; }

// Absolute trajectory error after the best similarity (Sturm et al. 2012); metres if the ground truth is
// metric. The error is always that of the best fit of the positions.
struct TrajectoryError {
  Sim3d S_world_map;  // p_world = S_world_map * p_map, by the alignment asked for
  int pairs = 0;      // poses with a ground-truth pose within the time limit
  double rmse = 0.0;
  double mean = 0.0;
  double median = 0.0;
  double max = 0.0;
  double path_length = 0.0;  // length of the true path between the first and the last pair
};

// Pairs each estimated pose with the ground-truth pose nearest in time, at most max_time_difference seconds
// away, each ground-truth pose once. Both must be ordered by time. Returns indices into both.
std::vector<std::pair<std::size_t, std::size_t>> AssociateByTime(const Trajectory& estimated,
                                                                 const Trajectory& truth,
                                                                 double max_time_difference);

// Returns nothing if fewer than three poses pair up, or if they lie on one line or point.
std::optional<TrajectoryError> ComputeTrajectoryError(const Trajectory& estimated, const Trajectory& truth,
                                                      double max_time_difference,
                                                      Alignment alignment = Alignment::kPositions);

// Splits a trajectory at gaps, which are several times as long as the typical step.
std::vector<Trajectory> SplitAtGaps(const Trajectory& trajectory);

// A true camera path aligned with a map, with the error of the map's keyframes.
struct TruePath : TrajectoryError {
  std::vector<std::vector<Eigen::Vector3d>> pieces;  // map frame; split where poses are missing
};

// Aligns the truth with the keyframes by the best similarity, as `sqslam eval` does with the frames (Umeyama;
// at most `max_time_difference` seconds between a pose and its truth). The path covers the time span of the
// map. Empty if fewer than three keyframes have a true pose or if these lie on one line.
std::optional<TruePath> AlignTruePath(const Trajectory& truth, const MapSnapshot& map,
                                      double max_time_difference = 0.02);

}  // namespace sqslam
