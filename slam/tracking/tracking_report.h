#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "slam/map/map.h"
#include "slam/objects/object_types.h"
#include "slam/snapshot/snapshot.h"
#include "slam/tracking/pose_tracker.h"

namespace sqslam {

struct KeyframeCandidate {
  FrameFeaturesPtr features;
  std::vector<PointId> points;  // one per keypoint
};

// A frame, and the map that it was tracked in.
struct FrameStamp {
  std::int64_t submap = 0;
  Sim3d S_map_origin;  // origin of the map frame of then, see AtlasView::Origin
  std::int64_t frame_index = 0;
  double timestamp = 0.0;
  std::string image_path;
};

// The boxes of one frame, and the objects that they show. Boxes of a detector in the process come some frames
// late.
struct SeenObjects : FrameStamp {
  std::vector<SnapshotDetection> detections;
  std::vector<ObjectObservation> observations;  // none while lost
};

// The tracking thread's message to the mapping thread after each frame.
struct TrackingReport : FrameStamp {
  double tracking_ms = 0.0;          // that the frame took; 0: not measured
  std::unique_ptr<Map> initial_map;  // set once, when a submap begins
  std::optional<AnchoredPose> pose;  // empty while lost
  std::vector<FrameMatch> matches;   // by which it was found
  SeenPoints seen;
  std::optional<KeyframeCandidate> keyframe;
  bool keyframe_postponed = false;     // one was due, but the mapping thread is busy
  FrameFeaturesPtr unplaced;           // what it showed, where it has no pose
  std::optional<Backlog> backlog;      // set when tracking begins or was found again
  std::optional<SeenObjects> objects;  // empty while a detector is at work on the frame
};

}  // namespace sqslam
