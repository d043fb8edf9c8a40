#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "slam/geometry/rigid3.h"
#include "slam/snapshot/snapshot.h"

namespace sqslam {

struct TimedPose {
  double timestamp = 0.0;  // seconds
  Rigid3d T_map_camera;
};
using Trajectory = std::vector<TimedPose>;

// TUM format: "timestamp tx ty tz qx qy qz qw". Reading accepts the cells of any TextTable, in the order that
// the names of its columns give, and further columns. Rows without a pose (NaN, or a quaternion of zeros) and
// all but the first of equal times are skipped with a warning that counts them. Throws InputError that names
// file and line. `metres_per_unit`: for the comment of a trajectory in metres (UnitComment). `upright`: of
// the map, for the comment.
Trajectory ReadTrajectory(const std::filesystem::path& path);
void WriteTrajectory(const std::filesystem::path& path, const Trajectory& trajectory,
                     double metres_per_unit = 1.0, bool upright = false);

// Returns the poses of a map's keyframes.
Trajectory KeyframeTrajectory(const MapSnapshot& map);

// Returns the poses of all tracked frames: those of trajectory.txt beside a recording, or without it those of
// the keyframes of its map.
Trajectory TrackedPoses(const std::filesystem::path& recording, const MapSnapshot& map);

// Returns a function for the pose at a timestamp (to 0.1 ms), which returns nothing if there is none.
std::function<std::optional<Rigid3d>(double timestamp)> PosesByTime(Trajectory trajectory);

struct Sequence;
using PosesByFrame = std::map<std::int64_t, Rigid3d>;  // T_map_camera by index of the frame

// Returns the poses of a trajectory.txt by the frames of the sequence with the same times. Empty if the file
// is missing; throws InputError if it is broken.
PosesByFrame ReadPosesByFrame(const std::filesystem::path& trajectory, const Sequence& sequence);

}  // namespace sqslam
