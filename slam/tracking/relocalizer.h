#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "slam/map/map.h"
#include "slam/recognition/place_index.h"
#include "slam/recognition/vocabulary.h"
#include "slam/tracking/pose_tracker.h"

namespace sqslam {

// Finds keyframes of all submaps that may show the same place as a frame. Follows the views that the mapping
// thread publishes with an index of its own, so that neither thread waits for the other.
class Relocalizer {
 public:
  // `vocabulary`: null leaves only the keyframe that was tracked last.
  explicit Relocalizer(std::shared_ptr<const Vocabulary> vocabulary) : vocabulary_(std::move(vocabulary)) {}

  struct Candidate {
    TrackingViewPtr view;
    KeyframeId keyframe = kNoKeyframe;
  };

  // Best first, and before all others the keyframe that was tracked last. `view`: newest of the submap
  // tracked last, which the atlas (null allowed) may not know yet.
  std::vector<Candidate> Candidates(const AtlasViewPtr& atlas, const TrackingViewPtr& view,
                                    const std::optional<TrackedFrame>& last, const TrackedFrame& frame);

 private:
  void Follow(const AtlasViewPtr& atlas, const TrackingViewPtr& view);

  std::shared_ptr<const Vocabulary> vocabulary_;
  std::map<std::int64_t, TrackingViewPtr> views_;  // by submap, as indexed
  std::map<KeyframeId, std::int64_t> submap_of_;   // submaps of the keyframes that are indexed
  PlaceIndex index_;
};

}  // namespace sqslam
