#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "slam/map/map.h"
#include "slam/map/snapshot.h"
#include "slam/objects/object_types.h"

namespace sqslam {

// Pose of a frame relative to a keyframe: stays right when the map is optimised, moved or turned later.
struct AnchoredPose {
  KeyframeId reference = kNoKeyframe;
  Rigid3d T_camera_reference;
};

struct KeyframeCandidate {
  FrameFeaturesPtr features;
  std::vector<PointId> points;  // one per keypoint
};

// What the tracking thread tells the mapping thread after each frame.
struct TrackingReport {
  std::int64_t map_number = 0;  // the map this frame was tracked in
  std::int64_t frame_index = 0;
  double timestamp = 0.0;
  std::string image_path;
  std::unique_ptr<Map> initial_map;  // set once, when a map begins
  std::optional<AnchoredPose> pose;  // empty while lost
  std::vector<PointId> visible;      // map points predicted to be in the image
  std::vector<PointId> found;        // of these, the ones that were matched
  std::optional<KeyframeCandidate> keyframe;
  bool keyframe_postponed = false;  // one was due, but the mapping thread is busy
  std::vector<SnapshotDetection> detections;
  std::vector<ObjectObservation> objects;
  Rigid3d T_map_origin;  // of the view in which `objects` are expressed
};

}  // namespace sqslam
