#pragma once

#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/io/trajectory.h"
#include "slam/map/tracking_view.h"
#include "slam/mapping/upright.h"
#include "slam/objects/object_mapper.h"
#include "slam/system_options.h"
#include "slam/tracking/tracking_report.h"
#include "slam/util/stage_times.h"

namespace sqslam {

// The mapping thread's pipeline and the only owner of the live map. Takes the tracking thread's reports in
// order and publishes immutable copies: TrackingView for tracking, MapSnapshot for everyone else.
class Mapper {
 public:
  struct Outputs {
    std::function<void(TrackingViewPtr)> publish_view;
    std::function<void(MapSnapshotPtr)> publish_snapshot;
    std::function<bool()> keyframe_waiting;  // a waiting keyframe interrupts the bundle adjustment
  };

  Mapper(const Camera& camera, const SystemOptions& options, Outputs outputs, StageTimes& times);

  void Process(TrackingReport report);

  // Last optimisation, last snapshot (null where there is no map).
  MapSnapshotPtr Finish();

  Trajectory FrameTrajectory() const;
  Trajectory KeyframeTrajectory() const;

 private:
  struct FrameRecord {
    double timestamp = 0.0;
    AnchoredPose pose;
  };

  void StartMap(TrackingReport& report);
  void RecordFrame(TrackingReport& report);
  void AddKeyframe(const TrackingReport& report);
  void OptimizeLocally(KeyframeId keyframe);
  void MapObjects();
  void KeepUpright(bool last);
  void PublishView();
  MapSnapshotPtr MakeSnapshot() const;
  PointLookup LookupPoints();
  PoseLookup LookupPoses() const;
  Rigid3d FramePose(const FrameRecord& record) const;  // T_map_camera

  Camera camera_;
  SystemOptions options_;
  Outputs outputs_;
  StageTimes& times_;

  std::int64_t map_number_ = 0;
  std::unique_ptr<Map> map_;
  std::set<PointId> young_points_;
  std::map<std::int64_t, FrameRecord> frames_;  // by frame index
  UprightEstimator upright_;
  ObjectMapper objects_;
  Rigid3d T_map_origin_;

  // Of the newest frame, for the snapshot.
  std::int64_t frame_index_ = 0;
  double timestamp_ = 0.0;
  std::string image_path_;
  std::vector<SnapshotDetection> detections_;
  mutable std::int64_t snapshots_ = 0;
};

}  // namespace sqslam
