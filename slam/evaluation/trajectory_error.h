#pragma once

#include <Eigen/Core>
#include <optional>
#include <utility>
#include <vector>

#include "slam/geometry/rigid3.h"
#include "slam/io/trajectory.h"

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

}  // namespace sqslam
