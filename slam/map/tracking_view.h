#pragma once

#include <memory>
#include <vector>

#include "slam/map/map.h"

namespace sqslam {

struct ObjectMapView;  // slam/objects/object_types.h

// A map point as far as the tracking thread needs it.
struct ViewPoint : PointAppearance {
  bool well_observed = false;  // by three keyframes or more
};

struct ViewKeyframe {
  KeyframeId id = kNoKeyframe;
  ScaledPose pose;
  FrameFeaturesPtr features;
  BagOfWordsPtr words;
  std::vector<PointId> points;
  std::vector<KeyframeId> covisible;  // best first
};

// An immutable copy of one submap for the tracking thread, published by the mapping thread after each of its
// steps, so that neither ever waits for the other.
struct TrackingView {
  std::int64_t submap = 0;
  std::map<KeyframeId, ViewKeyframe> keyframes;
  std::map<KeyframeId, ScaledPose> removed_poses;  // poses of culled keyframes
  PointTable<ViewPoint> points;
  bool gravity_known = false;
  std::shared_ptr<const ObjectMapView> objects;

  PointId Resolve(PointId id) const { return points.Resolve(id); }
  bool Has(PointId id) const { return points.IsAlive(id); }
  const ViewPoint& Point(PointId id) const { return points.At(id); }
  bool Knows(KeyframeId id) const { return keyframes.contains(id) || removed_poses.contains(id); }
  ScaledPose PoseOf(KeyframeId id) const {
    const auto it = keyframes.find(id);
    return it != keyframes.end() ? it->second.pose : removed_poses.at(id);
  }
};

using TrackingViewPtr = std::shared_ptr<const TrackingView>;

TrackingView MakeTrackingView(const Map& map);

// All submaps of a run. A submap begins where tracking is lost and not found again; it is dormant while
// another one is tracked, and ends when it is merged into an older one.
struct AtlasView {
  // A submap's fate: the one that holds its content now, and the motion of its frame.
  struct Origin {
    std::int64_t submap = 0;
    Sim3d S_map_origin;  // from the frame in which it began to the present frame of `submap`
  };
  std::map<std::int64_t, TrackingViewPtr> submaps;
  std::map<std::int64_t, Origin> origins;  // by number, of every submap that ever began
};

using AtlasViewPtr = std::shared_ptr<const AtlasView>;

}  // namespace sqslam
