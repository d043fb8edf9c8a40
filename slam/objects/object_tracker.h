#pragma once

#include <memory>
#include <vector>

#include "slam/objects/object_options.h"
#include "slam/objects/object_types.h"
#include "slam/util/stage_times.h"

namespace sqslam {

// Object tracking in the tracking thread: associates the boxes of a frame with landmarks, creates new
// landmarks, and takes the measurements of one frame (centroid, yaw, points that leave the box).
//
//   auto observations = tracker.Track(frame, *mapper_view);
//
// Landmark ids are 0, 1, 2, ... in the order of their first sighting, across all submaps. Not thread-safe;
// deterministic.
class ObjectTracker {
 public:
  explicit ObjectTracker(const ObjectOptions& options);
  ~ObjectTracker();
  ObjectTracker(ObjectTracker&&) noexcept;
  ObjectTracker& operator=(ObjectTracker&&) noexcept;

  // Returns one observation per usable box, those of no landmark with the id -1. `view` may lag behind;
  // frame_index must grow. If given, `times` receives the duration of the stage tracking.association.
  std::vector<ObjectObservation> Track(const ObjectFrame& frame, const ObjectMapView& view,
                                       StageTimes* times = nullptr);

  // New landmarks get ids from `id` on: other submaps have used the ones below.
  void StartIdsAt(int id);
  int NextId() const;

  // Applies a change of the map frame: p_new = S_new_old * p_old.
  void Transform(const Sim3d& S_new_old);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sqslam
