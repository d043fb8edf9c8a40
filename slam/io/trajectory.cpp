#include "slam/io/trajectory.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <functional>
#include <iterator>
#include <string_view>
#include <utility>

#include "slam/io/map_frame.h"
#include "slam/io/sequence.h"
#include "slam/snapshot/map_scale.h"
#include "slam/util/atomic_file.h"
#include "slam/util/text_table.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

constexpr double kTimeTolerance = 1e-4;  // seconds; files have six digits

// Columns of time, x, y, z, qx, qy, qz, qw.
using PoseColumns = std::array<std::size_t, 8>;

// Returns the place in PoseColumns of a column of this name, such as "tx", "pos_x", "q_rs_w []" or "timestamp
// [ns]": the last letter before a unit is the axis, and a name that begins with q, r or o, or holds "orient",
// is of the quaternion. Returns nothing for other names.
std::optional<std::size_t> PoseColumnNamed(std::string_view name) {
  name = name.substr(0, name.find_first_of("[("));
  while (!name.empty() && std::isalpha(static_cast<unsigned char>(name.back())) == 0) {
    name.remove_suffix(1);
  }
  const std::size_t axis = name.empty() ? std::string_view::npos : std::string_view("xyzw").find(name.back());
  if (name == "t" || name.starts_with("time") || name.starts_with("stamp")) {
    return 0;
  }
  if (axis == std::string_view::npos) {
    return std::nullopt;
  }
  const bool quaternion = axis == 3 || name.find("orient") != std::string_view::npos ||
                          (name.size() > 1 && std::string_view("qro").find(name[0]) < 3);
  return (quaternion ? 4 : 1) + axis;
}

// Returns the columns by their names, the first for a time without one, or in TUM's order if the names do not
// tell all of the pose.
PoseColumns PoseColumnsOf(const std::vector<std::string>& names) {
  constexpr PoseColumns kTumColumns = {0, 1, 2, 3, 4, 5, 6, 7};
  PoseColumns columns{};
  std::array<bool, 8> named{};
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::optional<std::size_t> place = PoseColumnNamed(names[i]);
    if (place && !named[*place]) {
      named[*place] = true;
      columns[*place] = i;
    }
  }
  return std::ranges::all_of(named.begin() + 1, named.end(), std::identity()) ? columns : kTumColumns;
}

// Returns the pose of a row; nothing if it has none: NaN, as trackers write where they are lost, or a
// quaternion of zeros.
std::optional<TimedPose> PoseIn(const std::filesystem::path& path, const TextLine& row,
                                const PoseColumns& columns) {
  std::array<double, 8> v{};
  for (std::size_t i = 0; i < v.size(); ++i) {
    const std::optional<double> number =
        columns[i] < row.words.size() ? ParseNumber<double>(row.words[columns[i]]) : std::nullopt;
    if (!number) {
      ThrowBadLine(path, row, "'timestamp tx ty tz qx qy qz qw'");
    }
    v[i] = *number;
  }
  const Eigen::Quaterniond rotation(v[7], v[4], v[5], v[6]);
  if (!std::ranges::all_of(v, [](double number) { return std::isfinite(number); }) ||
      rotation.coeffs().isZero(0.0)) {
    return std::nullopt;
  }
  if (std::abs(rotation.norm() - 1.0) > 0.01) {
    ThrowBadLine(path, row, "a quaternion qx qy qz qw of length 1");
  }
  return TimedPose{v[0], {rotation.normalized(), {v[1], v[2], v[3]}}};
}

}  // namespace

Trajectory ReadTrajectory(const std::filesystem::path& path) {
  const TextTable table = ReadTextTable(path, "a trajectory in TUM format");
  const PoseColumns columns = PoseColumnsOf(table.names);
  Trajectory trajectory;
  int without_pose = 0;
  int equal_times = 0;
  for (const TextLine& row : table.rows) {
    const std::optional<TimedPose> pose = PoseIn(path, row, columns);
    if (!pose) {
      ++without_pose;
    } else if (trajectory.empty() || pose->timestamp > trajectory.back().timestamp) {
      trajectory.push_back(*pose);
    } else if (pose->timestamp == trajectory.back().timestamp) {
      ++equal_times;
    } else {
      ThrowBadLine(
          path, row,
          fmt::format("a timestamp after {:.6f}, that of the line before", trajectory.back().timestamp));
    }
  }
  if (without_pose > 0) {
    spdlog::warn("{}: {} of {} rows have no pose (not a number), skipped", path.string(), without_pose,
                 table.rows.size());
  }
  if (equal_times > 0) {
    spdlog::warn("{}: {} of {} rows repeat the time of the row before, skipped", path.string(), equal_times,
                 table.rows.size());
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

void WriteTrajectory(const std::filesystem::path& path, const Trajectory& trajectory, double metres_per_unit,
                     bool upright) {
  const std::string unit = UnitComment(metres_per_unit);
  std::string text =
      fmt::format("# timestamp tx ty tz qx qy qz qw (T_map_camera); {}{}; {}\n",
                  unit.empty() ? "map units" : "metres, ", unit, MapFrame{.upright = upright}.Frame());
  for (const TimedPose& pose : trajectory) {
    const auto& [rotation, translation] = pose.T_map_camera;
    fmt::format_to(std::back_inserter(text), "{:.6f} {:.9f} {:.9f}\n", pose.timestamp,
                   fmt::join(translation, " "), fmt::join(rotation.coeffs(), " "));  // x y z w
  }
  WriteFileAtomically(path, text);
}

}  // namespace sqslam
