#include "slam/run/path_check.h"

#include <fmt/format.h>

#include <algorithm>

#include "slam/util/statistics.h"

namespace sqslam {

std::vector<PathJump> FindJumps(const Trajectory& trajectory) {
  constexpr std::size_t kAround = 15;  // steps on either side
  constexpr double kMinTimes = 20.0;   // of the median step
  constexpr double kMinOfNext = 4.0;   // of the fastest other step
  std::vector<double> speeds;
  for (std::size_t i = 1; i < trajectory.size(); ++i) {
    const double seconds = trajectory[i].timestamp - trajectory[i - 1].timestamp;
    speeds.push_back(
        (trajectory[i].T_map_camera.translation - trajectory[i - 1].T_map_camera.translation).norm() /
        std::max(seconds, 1e-6));
  }
  std::vector<PathJump> jumps;
  for (std::size_t i = 0; i < speeds.size(); ++i) {
    std::vector<double> around;
    for (std::size_t k = i < kAround ? 0 : i - kAround; k < std::min(i + kAround + 1, speeds.size()); ++k) {
      const bool beside = k + 1 == i || k == i + 1;  // a single wrong pose makes two such steps
      if (k != i && !beside) {
        around.push_back(speeds[k]);
      }
    }
    if (around.size() < kAround / 2) {
      continue;
    }
    const double fastest = std::ranges::max(around);
    const double usual = UpperMedian(std::move(around));
    if (speeds[i] > kMinTimes * usual && speeds[i] > kMinOfNext * fastest) {
      jumps.push_back(
          {trajectory[i].timestamp, trajectory[i + 1].timestamp, speeds[i] / std::max(usual, 1e-12)});
    }
  }
  return jumps;
}

std::string InWords(const std::vector<PathJump>& jumps) {
  constexpr std::size_t kListed = 5;
  std::string list;
  for (std::size_t i = 0; i < std::min(kListed, jumps.size()); ++i) {
    list += fmt::format("{}{:.3f} to {:.3f} s", i > 0 ? ", " : "", jumps[i].before, jumps[i].after);
  }
  return fmt::format(
      "the camera's path jumps at {}{}: the map may be wrong there", list,
      jumps.size() > kListed ? fmt::format(" and {} more places", jumps.size() - kListed) : "");
}

}  // namespace sqslam
