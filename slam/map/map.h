#pragma once

#include <map>
#include <optional>
#include <vector>

#include "slam/features/orb_extractor.h"
#include "slam/geometry/rigid3.h"
#include "slam/map/keyframe.h"
#include "slam/map/map_point.h"

namespace sqslam {

// Keyframes and map points with their mutual references kept consistent. Owned by one thread; others see
// TrackingView and MapSnapshot. Ids are never reused. Iteration is in the order of ids, so that runs can be
// repeated.
class Map {
 public:
  explicit Map(const ScaleLevels& levels) : levels_(levels) {}

  KeyframeId AddKeyframe(std::int64_t frame_index, double timestamp, const Rigid3d& T_camera_map,
                         FrameFeaturesPtr features);
  PointId AddPoint(const Eigen::Vector3d& p_map, KeyframeId first_keyframe);

  void AddObservation(PointId point, KeyframeId keyframe, int keypoint);
  void RemoveObservation(PointId point,
                         KeyframeId keyframe);  // removes the point too when fewer than 2 are left
  void RemovePoint(PointId point);
  void Fuse(PointId dropped, PointId kept);
  void RemoveKeyframe(KeyframeId keyframe);  // its pose stays known relative to its parent

  // Recomputes what follows from the observations.
  void UpdateAppearance(PointId point);  // descriptor, normal, distance range
  void UpdateNormalAndRange(
      PointId point);  // normal and distance range only: after the point or a camera moved
  void UpdateCovisibility(KeyframeId keyframe);

  // Moves the whole map: p_new = T_new_old * p_old.
  void Transform(const Rigid3d& T_new_old);

  bool HasKeyframe(KeyframeId id) const { return keyframes_.contains(id); }
  Keyframe& At(KeyframeId id) { return keyframes_.at(id); }
  const Keyframe& At(KeyframeId id) const { return keyframes_.at(id); }
  MapPoint& Point(PointId id) { return points_[static_cast<std::size_t>(id)]; }
  const MapPoint& Point(PointId id) const { return points_[static_cast<std::size_t>(id)]; }
  bool IsAlive(PointId id) const { return id >= 0 && Point(id).alive; }

  // Follows fusions; kNoPoint where the point is gone.
  PointId Resolve(PointId id) const;

  // Pose of a keyframe, also of a removed one.
  Rigid3d PoseOf(KeyframeId id) const;

  const std::map<KeyframeId, Keyframe>& Keyframes() const { return keyframes_; }
  const std::vector<MapPoint>& Points() const { return points_; }  // the dead ones included
  int NumPoints() const { return alive_points_; }
  const ScaleLevels& Levels() const { return levels_; }
  KeyframeId NewestKeyframe() const { return keyframes_.empty() ? kNoKeyframe : keyframes_.rbegin()->first; }

  struct RemovedKeyframe {
    KeyframeId parent = kNoKeyframe;
    Rigid3d T_camera_parent;
  };
  const std::map<KeyframeId, RemovedKeyframe>& Removed() const { return removed_; }

 private:
  ScaleLevels levels_;
  std::map<KeyframeId, Keyframe> keyframes_;
  std::map<KeyframeId, RemovedKeyframe> removed_;
  std::vector<MapPoint> points_;
  int alive_points_ = 0;
  KeyframeId next_keyframe_ = 0;
};

}  // namespace sqslam
