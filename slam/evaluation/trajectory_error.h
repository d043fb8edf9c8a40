#pragma once

#include <Eigen/Core>
#include <optional>
#include <utility>
#include <vector>

#include "slam/geometry/rigid3.h"
#include "slam/io/trajectory.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

// Absolute trajectory error after the best similarity (Sturm et al. 2012); metres where the ground truth is
// metric.
struct TrajectoryError {
  Sim3d S_world_map;  // p_world = S_world_map * p_map
  int pairs = 0;      // poses with a ground-truth pose within the time limit
  double rmse = 0.0;
  double mean = 0.0;
  double median = 0.0;
  double max = 0.0;
  double path_length = 0.0;  // length of the true path between the first and the last pair
};

// Pairs each estimated pose with the ground-truth pose nearest in time, at most max_time_difference seconds
// away, each ground-truth pose once. Both in order of time. (indices into estimated and truth)
std::vector<std::pair<std::size_t, std::size_t>> AssociateByTime(const Trajectory& estimated,
                                                                 const Trajectory& truth,
                                                                 double max_time_difference);

// Empty where fewer than three poses pair up or where they lie on one line or point.
std::optional<TrajectoryError> ComputeTrajectoryError(const Trajectory& estimated, const Trajectory& truth,
                                                      double max_time_difference);

// The pieces between gaps, which are several times as long as the steps usually are.
std::vector<Trajectory> SplitAtGaps(const Trajectory& trajectory);

// A true camera path laid over a map.
struct TruePath {
  Sim3d S_world_map;                                 // p_world = S_world_map * p_map
  std::vector<std::vector<Eigen::Vector3d>> pieces;  // map frame; broken where poses are missing
  double rmse = 0.0;                                 // metres between keyframes and truth (ATE)
  int pairs = 0;                                     // keyframes with a true pose
};

// Lays the truth over the keyframes by the best similarity, as `sqslam eval` does over the frames (Umeyama;
// at most `max_time_difference` seconds between a pose and its truth). The path is that of the time that the
// map covers. Empty where fewer than three keyframes have a true pose or where those lie on one line.
std::optional<TruePath> LayTruePath(const Trajectory& truth, const MapSnapshot& map,
                                    double max_time_difference = 0.02);

}  // namespace sqslam
