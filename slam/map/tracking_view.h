#pragma once

#include <memory>
#include <vector>

#include "slam/map/map.h"

namespace sqslam {

struct ObjectMapView;  // slam/objects/object_types.h

// What the tracking thread needs of a map point.
struct ViewPoint {
  Eigen::Vector3d p_map;
  Eigen::Vector3d normal;
  double min_distance = 0.0;
  double max_distance = 0.0;
  Descriptor descriptor;
  bool alive = false;
  bool well_observed = false;  // by three keyframes or more
  PointId replaced_by = kNoPoint;
};

struct ViewKeyframe {
  KeyframeId id = kNoKeyframe;
  Rigid3d T_camera_map;
  FrameFeaturesPtr features;
  std::vector<PointId> points;
  std::vector<KeyframeId> covisible;  // best first
};

// An immutable copy of the map for the tracking thread, published by the mapping thread after each of its
// steps, so that neither ever waits for the other.
struct TrackingView {
  std::int64_t map_number = 0;  // counts maps: a new one begins after a reset
  std::map<KeyframeId, ViewKeyframe> keyframes;
  std::map<KeyframeId, Rigid3d> removed_poses;  // T_camera_map of culled keyframes
  std::vector<ViewPoint> points;                // index = PointId
  Rigid3d T_map_origin;                         // from the frame in which the map began to the present one
  bool gravity_known = false;
  std::shared_ptr<const ObjectMapView> objects;

  PointId Resolve(PointId id) const {
    while (id >= 0 && id < static_cast<PointId>(points.size()) &&
           !points[static_cast<std::size_t>(id)].alive) {
      id = points[static_cast<std::size_t>(id)].replaced_by;
    }
    return id;
  }
  bool Has(PointId id) const { return id >= 0 && id < static_cast<PointId>(points.size()); }
  const ViewPoint& Point(PointId id) const { return points[static_cast<std::size_t>(id)]; }
  Rigid3d PoseOf(KeyframeId id) const {
    const auto it = keyframes.find(id);
    return it != keyframes.end() ? it->second.T_camera_map : removed_poses.at(id);
  }
};

using TrackingViewPtr = std::shared_ptr<const TrackingView>;

TrackingView MakeTrackingView(const Map& map);

}  // namespace sqslam
