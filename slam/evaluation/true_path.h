#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <vector>

#include "slam/geometry/rigid3.h"
#include "slam/io/trajectory.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

// The poses T_world_camera that come with a sequence (ground_truth_poses.h), in metres. Throws InputError.
Trajectory ReadTruePoses(const std::filesystem::path& sequence);

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
