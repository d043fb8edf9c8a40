#include "slam/io/trajectory.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <utility>

#include "slam/io/sequence.h"
#include "slam/snapshot/map_scale.h"
#include "slam/util/atomic_file.h"
#include "slam/util/text_lines.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

constexpr double kTimeTolerance = 1e-4;  // seconds; files have six digits

}  // namespace

Trajectory ReadTrajectory(const std::filesystem::path& path) {
  constexpr const char* kExpected = "'timestamp tx ty tz qx qy qz qw'";
  Trajectory trajectory;
  for (const TextLine& line : ReadTextLines(path, "a trajectory in TUM format")) {
    const std::array<double, 8> v = NumbersIn<8>(path, line, kExpected);
    const Eigen::Quaterniond rotation(v[7], v[4], v[5], v[6]);
    if (std::abs(rotation.norm() - 1.0) > 0.01) {
      ThrowBadLine(path, line, "a quaternion qx qy qz qw of length 1");
    }
    if (!trajectory.empty() && v[0] <= trajectory.back().timestamp) {
      ThrowBadLine(
          path, line,
          fmt::format("a timestamp after {:.6f}, that of the line before", trajectory.back().timestamp));
    }
    trajectory.push_back({v[0], {rotation.normalized(), {v[1], v[2], v[3]}}});
  }
  return trajectory;
}

Trajectory KeyframeTrajectory(const MapSnapshot& map) {
  return ToVector(map.keyframes, [](const SnapshotKeyframe& keyframe) {
    return TimedPose{keyframe.timestamp, keyframe.T_map_camera};
  });
}

Trajectory TrackedPoses(const std::filesystem::path& recording, const MapSnapshot& map) {
  const std::filesystem::path file = recording.parent_path() / "trajectory.txt";
  Trajectory trajectory = std::filesystem::exists(file) ? ReadTrajectory(file) : Trajectory();
  return trajectory.empty() ? KeyframeTrajectory(map) : trajectory;
}

std::function<std::optional<Rigid3d>(double timestamp)> PosesByTime(Trajectory trajectory) {
  return [trajectory = std::move(trajectory)](double timestamp) -> std::optional<Rigid3d> {
    const auto it =
        std::ranges::lower_bound(trajectory, timestamp - kTimeTolerance, {}, &TimedPose::timestamp);
    return it != trajectory.end() && it->timestamp < timestamp + kTimeTolerance
               ? std::optional(it->T_map_camera)
               : std::nullopt;
  };
}

PosesByFrame ReadPosesByFrame(const std::filesystem::path& trajectory, const Sequence& sequence) {
  PosesByFrame poses;
  if (!std::filesystem::exists(trajectory)) {
    return poses;
  }
  const auto pose_at = PosesByTime(ReadTrajectory(trajectory));
  for (std::size_t i = 0; i < sequence.frames.size(); ++i) {
    if (const std::optional<Rigid3d> pose = pose_at(sequence.frames[i].timestamp)) {
      poses.emplace(static_cast<std::int64_t>(i), *pose);
    }
  }
  return poses;
}

void WriteTrajectory(const std::filesystem::path& path, const Trajectory& trajectory,
                     double metres_per_unit) {
  const std::string unit = UnitComment(metres_per_unit);
  std::string text = fmt::format("# timestamp tx ty tz qx qy qz qw (T_map_camera){}{}\n",
                                 unit.empty() ? "" : "; metres, ", unit);
  for (const TimedPose& pose : trajectory) {
    const auto& [rotation, translation] = pose.T_map_camera;
    fmt::format_to(std::back_inserter(text), "{:.6f} {:.9f} {:.9f}\n", pose.timestamp,
                   fmt::join(translation, " "), fmt::join(rotation.coeffs(), " "));  // x y z w
  }
  WriteFileAtomically(path, text);
}

}  // namespace sqslam
