#pragma once

#include <memory>
#include <opencv2/core.hpp>
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

// A frame and the map in which it was tracked.
struct FrameStamp {
  std::int64_t submap = 0;
  Sim3d S_map_origin;  // origin of the map frame at that time, see AtlasView::Origin
  std::int64_t frame_index = 0;
  double timestamp = 0.0;
  std::string image_path;
};

// Bounding boxes of one frame and the objects they show. Boxes of an in-process detector arrive some frames
// late.
struct SeenObjects : FrameStamp {
  std::vector<SnapshotDetection> detections;
  std::vector<ObjectObservation> observations;  // none while lost
};

// The tracking thread's message to the mapping thread after each frame.
struct TrackingReport : FrameStamp {
  double tracking_ms = 0.0;          // time spent on the frame; 0: not measured
  std::unique_ptr<Map> initial_map;  // set once, when a submap begins
  std::optional<AnchoredPose> pose;  // empty while lost
  std::vector<FrameMatch> matches;   // that give the pose
  FrameFeaturesPtr matched;          // features of `matches`; null: those stay as detected
  SeenPoints seen;
  std::optional<KeyframeCandidate> keyframe;
  FrameFeaturesPtr features;           // for the end of the run: more than `matched` where views share little
  cv::Mat ignored;                     // 8UC1, nonzero where no features were taken; may be empty
  std::optional<Backlog> backlog;      // set when tracking begins or resumes
  std::optional<SeenObjects> objects;  // empty until the detector has processed the frame
};

// A tracked frame, for display.
struct FrameView {
  struct Feature {
    Eigen::Vector2f pixel;  // in the image as taken, distorted
    bool tracked = false;   // a map point was found there
  };
  std::int64_t frame_index = 0;
  std::optional<Rigid3d> T_map_camera;  // in tracking's view of the map; empty while lost
  std::vector<Feature> features;
};

}  // namespace sqslam
