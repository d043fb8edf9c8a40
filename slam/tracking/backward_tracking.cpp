#include "slam/tracking/backward_tracking.h"

#include <optional>
#include <ranges>

namespace sqslam {

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
