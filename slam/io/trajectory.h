#pragma once

#include <filesystem>
#include <vector>

#include "slam/geometry/rigid3.h"

namespace sqslam {

struct TimedPose {
  double timestamp = 0.0;  // seconds
  Rigid3d T_map_camera;
};
using Trajectory = std::vector<TimedPose>;

// TUM format: "timestamp tx ty tz qx qy qz qw". Reading throws InputError that names file and line.
Trajectory ReadTrajectory(const std::filesystem::path& path);
void WriteTrajectory(const std::filesystem::path& path, const Trajectory& trajectory);

}  // namespace sqslam
