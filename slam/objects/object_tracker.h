#pragma once

#include <memory>
#include <vector>

#include "slam/objects/object_options.h"
#include "slam/objects/object_types.h"
#include "slam/util/stage_times.h"

namespace sqslam {

// The objects' share of the tracking thread: decides which landmark each box of a frame belongs to, makes new
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

  // One observation for each box that was associated. `view` may lag behind; frame_index must grow. `times`,
  // where given, takes the duration of the stage tracking.association.
  std::vector<ObjectObservation> Track(const ObjectFrame& frame, const ObjectMapView& view,
                                       StageTimes* times = nullptr);

  // Ids for new landmarks begin no lower than this: other submaps have used the ones below.
  void StartIdsAt(int id);
  int NextId() const;

  // The map frame was changed: p_new = S_new_old * p_old.
  void Transform(const Sim3d& S_new_old);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sqslam
