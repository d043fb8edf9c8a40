#include "slam/mapping/background_adjustment.h"

#include <chrono>
#include <map>
#include <set>
#include <utility>

namespace sqslam {

void BackgroundAdjustment::Start(Job job, const BundleSolverOptions& options) {
  Stop();
  stop_ = false;
  const auto solve = [this, options](Job started) -> std::optional<Job> {
    const bool solved = solve_(started.problem, options, [this] { return stop_.load(); });
    return solved ? std::optional(std::move(started)) : std::nullopt;
  };
  running_ = std::async(std::launch::async, solve, std::move(job));
  calls_ = 0;
}

std::optional<BackgroundAdjustment::Job> BackgroundAdjustment::TakeFinished() {
  if (!running_.valid()) {
    return std::nullopt;
  }
  const bool due = in_step_ ? ++calls_ >= kCallsInStep
                            : running_.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
  return due ? running_.get() : std::nullopt;
}

std::optional<BackgroundAdjustment::Job> BackgroundAdjustment::Wait() {
  return running_.valid() ? running_.get() : std::nullopt;
}

void BackgroundAdjustment::Stop() {
  if (running_.valid()) {
    stop_ = true;
    running_.wait();
    running_ = {};
  }
}

void ApplyAdjustment(BundleProblem problem, const Sim3d& S_now_then, Map& map) {
  std::map<KeyframeId, Rigid3d> before;
  for (const auto& [id, keyframe] : map.Keyframes()) {
    before[id] = keyframe.T_camera_map;
  }
  std::map<KeyframeId, Rigid3d> after;
  for (BundlePose& pose : problem.poses) {
    pose.T_camera_map = MoveCamera(pose.T_camera_map, S_now_then);
    after[pose.id] = pose.T_camera_map;
  }
  std::set<PointId> adjusted;
  for (BundlePoint& point : problem.points) {
    point.p_map = S_now_then * point.p_map;
    adjusted.insert(point.id);
  }
  // Parents are older than their children: one pass in the order of ids moves every descendant.
  for (const auto& [id, T_camera_map] : before) {
    const KeyframeId parent = map.At(id).parent;
    if (!after.contains(id) && after.contains(parent) && before.contains(parent)) {
      after[id] = T_camera_map * before.at(parent).Inverse() * after.at(parent);
      map.At(id).T_camera_map = after[id];
    }
  }
  for (const MapPoint& const_point : map.Points()) {
    const KeyframeId carrier = const_point.observations.front().keyframe;
    if (!adjusted.contains(const_point.id) && after.contains(carrier)) {
      MapPoint& point = map.Point(const_point.id);
      point.p_map = after.at(carrier).Inverse() * (before.at(carrier) * point.p_map);
    }
  }
  ApplyBundle(problem, map);
  for (const MapPoint& point : map.Points()) {
    map.UpdateNormalAndRange(point.id);
  }
}

}  // namespace sqslam
