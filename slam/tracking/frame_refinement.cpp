#include "slam/tracking/frame_refinement.h"

#include <optional>
#include <ranges>

#include "slam/estimation/pose_optimization.h"

namespace sqslam {

std::vector<FrameMatch> MatchesOf(const TrackedFrame& frame, const ScaleLevels& levels) {
  std::vector<FrameMatch> matches;
  for (std::size_t i = 0; i < frame.points.size(); ++i) {
    if (frame.points[i] != kNoPoint) {
      const Keypoint& keypoint = frame.features->keypoints[i];
      matches.push_back({frame.points[i], keypoint.pixel.cast<float>(),
                         static_cast<float>(levels.Variance(keypoint.octave))});
    }
  }
  return matches;
}

Rigid3d RefineFrame(const Map& map, const Camera& camera, const std::vector<FrameMatch>& matches,
                    int min_inliers, const Rigid3d& T_camera_map) {
  std::vector<PointObservation> observations;
  for (const FrameMatch& match : matches) {
    if (const PointId point = map.Resolve(match.point); point != kNoPoint) {
      observations.push_back({map.Point(point).p_map, match.pixel.cast<double>(), match.variance, true});
    }
  }
  Rigid3d refined = T_camera_map;
  const bool enough = static_cast<int>(observations.size()) >= min_inliers &&
                      OptimizePose(camera, observations, refined) >= min_inliers;
  return enough ? refined : T_camera_map;
}

std::vector<TrackedFrame> TrackBackward(const PoseTracker& tracker, const TrackingView& view,
                                        const Backlog& backlog, int min_inliers) {
  constexpr int kGiveUpAfter = 10;  // frames in a row without a pose
  TrackedFrame last = backlog.next;
  last.T_camera_map = Resolve(last.anchor, view.PoseOf(last.anchor.reference)).T_camera_map;
  for (PointId& point : last.points) {
    point = view.Resolve(point);
  }
  std::vector<TrackedFrame> tracked;
  std::optional<Rigid3d> velocity;
  int failures = 0;
  for (const TrackedFrame& frame : std::views::reverse(backlog.earlier)) {
    TrackedFrame current = frame;
    SeenPoints seen;
    const bool found = (tracker.TrackMotion(view, last, velocity.value_or(Rigid3d{}), current) ||
                        tracker.TrackReferenceKeyframe(view, last, current)) &&
                       tracker.TrackLocalMap(view, {.min_inliers = min_inliers}, current, seen);
    if (!found) {
      velocity.reset();
      if (++failures == kGiveUpAfter) {
        break;
      }
      continue;
    }
    velocity = current.T_camera_map * last.T_camera_map.Inverse();
    failures = 0;
    tracked.push_back(current);
    last = std::move(current);
  }
  return tracked;
}

}  // namespace sqslam
