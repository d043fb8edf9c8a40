#pragma once

#include <map>
#include <memory>
#include <vector>

#include "slam/features/orb_extractor.h"
#include "slam/map/keyframe.h"
#include "slam/map/map_point.h"
#include "slam/map/point_table.h"

namespace sqslam {

// Keyframes and map points with their mutual references kept consistent. Owned by one thread; others see
// TrackingView and MapSnapshot. Ids are never reused. Iteration is in the order of ids, so that runs can be
// repeated. Memory follows what is alive: a removed point leaves eight bytes.
class Map {
 public:
  // `ids`: shared with the other submaps of a run; null: a source of its own.
  explicit Map(const ScaleLevels& levels, std::shared_ptr<IdSource> ids = nullptr);

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

  // Moves the whole map: p_new = S_new_old * p_old.
  void Transform(const Sim3d& S_new_old);
  void Transform(const Rigid3d& T_new_old) {
    Transform(Sim3d{1.0, T_new_old.rotation, T_new_old.translation});
  }

  // Takes over all that another map of the same IdSource holds, which must be in this map's frame already.
  void Absorb(Map&& other);

  bool HasKeyframe(KeyframeId id) const { return keyframes_.contains(id); }
  Keyframe& At(KeyframeId id) { return keyframes_.at(id); }
  const Keyframe& At(KeyframeId id) const { return keyframes_.at(id); }
  MapPoint& Point(PointId id) { return points_.At(id); }  // must be alive
  const MapPoint& Point(PointId id) const { return points_.At(id); }
  bool IsAlive(PointId id) const { return points_.IsAlive(id); }

  // Follows fusions; kNoPoint where the point is gone.
  PointId Resolve(PointId id) const { return points_.Resolve(id); }

  // Pose of a keyframe, also of a removed one.
  ScaledPose PoseOf(KeyframeId id) const;
  bool Knows(KeyframeId id) const { return keyframes_.contains(id) || removed_.contains(id); }

  const std::map<KeyframeId, Keyframe>& Keyframes() const { return keyframes_; }
  const PointTable<MapPoint>& Points() const { return points_; }
  int NumPoints() const { return points_.Size(); }
  const ScaleLevels& Levels() const { return levels_; }
  KeyframeId OldestKeyframe() const { return keyframes_.empty() ? kNoKeyframe : keyframes_.begin()->first; }
  KeyframeId NewestKeyframe() const { return keyframes_.empty() ? kNoKeyframe : keyframes_.rbegin()->first; }

  struct RemovedKeyframe {
    AnchoredPose pose;  // relative to its parent
    double scale = 1.0;
  };
  const std::map<KeyframeId, RemovedKeyframe>& Removed() const { return removed_; }

 private:
  ScaleLevels levels_;
  std::shared_ptr<IdSource> ids_;
  std::map<KeyframeId, Keyframe> keyframes_;
  std::map<KeyframeId, RemovedKeyframe> removed_;
  PointTable<MapPoint> points_;
};

}  // namespace sqslam
