#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "slam/map/tracking_view.h"
#include "slam/tracking/pose_tracker.h"

namespace sqslam {

// Finds keyframes of all submaps that may show the same place as a frame.
class Relocalizer {
 public:
  struct Place {
    std::int64_t submap = 0;
    KeyframeId keyframe = kNoKeyframe;
  };

  // Best first, and before all others the keyframe that was tracked last. `view`: newest of `submap`, which
  // the atlas (null allowed) may not know yet.
  std::vector<Place> Candidates(const AtlasViewPtr& atlas, std::int64_t submap, const TrackingViewPtr& view,
                                const std::optional<TrackedFrame>& last, const TrackedFrame& frame) const;
};

}  // namespace sqslam
