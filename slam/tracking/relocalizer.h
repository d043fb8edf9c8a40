#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "slam/map/map.h"
#include "slam/objects/detection_filter.h"
#include "slam/recognition/place_index.h"
#include "slam/recognition/vocabulary.h"
#include "slam/tracking/pose_tracker.h"

namespace sqslam {

// Finds the place of a frame in all submaps: by keyframes that look alike, or by mapped objects. Keeps its
// own index of the views that the mapping thread publishes, so that neither thread waits for the other.
class Relocalizer {
 public:
  // A null `vocabulary` leaves only the last reference keyframe.
  explicit Relocalizer(std::shared_ptr<const Vocabulary> vocabulary) : vocabulary_(std::move(vocabulary)) {}

  struct Candidate {
    TrackingViewPtr view;
    KeyframeId keyframe = kNoKeyframe;
  };

  // Returns the last reference keyframe, then the most similar ones, best first. `view`: newest view of the
  // submap tracked last, which the atlas (null allowed) may not contain yet.
  std::vector<Candidate> Candidates(const AtlasViewPtr& atlas, const TrackingViewPtr& view,
                                    const std::optional<TrackedFrame>& last, const TrackedFrame& frame);

  struct Found {
    TrackedFrame frame;  // `frame` with its pose
    TrackingViewPtr view;
  };

  // Relocates a frame among the candidates; returns the pose with the most points.
  std::optional<Found> ByWords(const PoseTracker& tracker, const AtlasViewPtr& atlas,
                               const TrackingViewPtr& view, const std::optional<TrackedFrame>& last,
                               const TrackedFrame& frame);

  // Relocates a frame near the poses that the boxes of mapped objects suggest; the map points there must
  // confirm it as they do for a keyframe. Uses the views of the last call of Candidates() or ByWords().
  std::optional<Found> ByObjects(const PoseTracker& tracker, const Camera& camera,
                                 const std::vector<BoxCandidate>& boxes, const TrackedFrame& frame) const;

 private:
  void UpdateIndex(const AtlasViewPtr& atlas, const TrackingViewPtr& view);

  std::shared_ptr<const Vocabulary> vocabulary_;
  std::map<std::int64_t, TrackingViewPtr> views_;  // by submap, as indexed
  std::map<KeyframeId, std::int64_t> submap_of_;   // submap of each indexed keyframe
  PlaceIndex index_;
};

}  // namespace sqslam
