#include "slam/evaluation/true_path.h"

#include <algorithm>

#include "slam/evaluation/ground_truth_poses.h"
#include "slam/evaluation/trajectory_error.h"
#include "slam/io/sequence.h"
#include "slam/util/statistics.h"

namespace sqslam {
namespace {

Trajectory KeyframesOf(const MapSnapshot& map) {
  Trajectory keyframes;
  for (const SnapshotKeyframe& keyframe : map.keyframes) {
    keyframes.push_back({keyframe.timestamp, keyframe.T_map_camera});
  }
  std::sort(keyframes.begin(), keyframes.end(),  // maps that became one are not in order of time
            [](const TimedPose& a, const TimedPose& b) { return a.timestamp < b.timestamp; });
  return keyframes;
}

// A gap is several times as long as the steps usually are.
double LongestStep(const Trajectory& truth) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < truth.size(); ++i) {
    steps.push_back(truth[i].timestamp - truth[i - 1].timestamp);
  }
  if (steps.empty()) {
    return 0.0;
  }
  return 5.0 * UpperMedian(std::move(steps)) + 1e-9;
}

}  // namespace

Trajectory ReadTruePoses(const std::filesystem::path& sequence) {
  SequenceRequest request;
  request.path = sequence;
  return ReadGroundTruthPoses(OpenSequence(request));
}

std::optional<TruePath> LayTruePath(const Trajectory& truth, const MapSnapshot& map,
                                    double max_time_difference) {
  const Trajectory keyframes = KeyframesOf(map);
  const std::optional<TrajectoryError> error = ComputeTrajectoryError(keyframes, truth, max_time_difference);
  if (!error) {
    return std::nullopt;
  }
  TruePath path;
  path.S_world_map = error->S_world_map;
  path.rmse = error->rmse;
  path.pairs = error->pairs;
  const Sim3d S_map_world = error->S_world_map.Inverse();
  const double begin = keyframes.front().timestamp - max_time_difference;
  const double end = std::max(keyframes.back().timestamp, map.timestamp) + max_time_difference;
  const double longest = LongestStep(truth);
  double last = 0.0;
  for (const TimedPose& pose : truth) {
    if (pose.timestamp < begin || pose.timestamp > end) {
      continue;
    }
    if (path.pieces.empty() || pose.timestamp - last > longest) {
      path.pieces.emplace_back();
    }
    path.pieces.back().push_back(S_map_world * pose.T_map_camera.translation);
    last = pose.timestamp;
  }
  return path;
}

}  // namespace sqslam
