#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <ranges>
#include <vector>

#include "slam/features/frame_features.h"
#include "slam/features/orb_extractor.h"
#include "slam/geometry/camera.h"
#include "slam/geometry/rigid3.h"
#include "slam/map/anchored_pose.h"
#include "slam/map/point_table.h"
#include "slam/recognition/vocabulary.h"

namespace sqslam {

// Returns the camera's pose after the map moved by p_new = S_new_old * p_old.
inline Rigid3d MoveCamera(const Rigid3d& T_camera_map, const Sim3d& S_new_old) {
  const Eigen::Quaterniond rotation = (T_camera_map.rotation * S_new_old.rotation.conjugate()).normalized();
  return {rotation, S_new_old.scale * T_camera_map.translation - rotation * S_new_old.translation};
}

struct Observation {
  KeyframeId keyframe = kNoKeyframe;
  int keypoint = 0;

  static void VisitState(auto& self, auto&& visit) { visit(self.keyframe, self.keypoint); }
};

// Attributes of a map point that matching in an image needs.
struct PointAppearance {
  Eigen::Vector3d p_map = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  // mean viewing direction towards it, unit length
  double min_distance = 0.0;                         // camera distances at which it can be matched, map units
  double max_distance = 0.0;
  double level_zero_distance = 0.0;  // at which level 0 shows it as first observed
  Descriptor descriptor{};           // of the observation nearest to all others
};

// Predicted view of a map point.
struct PredictedSight {
  Eigen::Vector2d pixel;
  double distance = 0.0;  // from the camera, map units
  double cosine = 0.0;    // of the angle between the ray and the point's normal
};

// Predicts the view of a point from a camera at `center`. Empty if it lies behind the camera, outside the
// image or outside its range of distances, or is viewed over 60 degrees off its normal (ORB-SLAM, Mur-Artal
// et al. 2015, V-D).
std::optional<PredictedSight> PredictSight(const PointAppearance& point, const Camera& camera,
                                           const Rigid3d& T_camera_map, const Eigen::Vector3d& center);

struct MapPoint : PointAppearance {
  PointId id = kNoPoint;
  std::array<std::uint8_t, 3> rgb{};
  std::vector<Observation> observations;
  KeyframeId first_keyframe = kNoKeyframe;
  int visible = 1;  // frames in which it was predicted to be in the image
  int found = 1;    // frames in which it was matched

  double FoundRatio() const { return static_cast<double>(found) / visible; }
  bool IsSeenBy(KeyframeId keyframe) const;

  // Leaves out appearance and colour, which follow from the observations.
  static void VisitState(auto& self, auto&& visit) {
    visit(self.id, self.p_map, self.observations, self.first_keyframe, self.visible, self.found);
  }
};

using BagOfWordsPtr = std::shared_ptr<const BagOfWords>;

// A frame that the map keeps, as a node of the covisibility graph and the spanning tree (ORB-SLAM, Mur-Artal
// et al. 2015, III-C).
struct Keyframe {
  KeyframeId id = kNoKeyframe;
  std::int64_t frame_index = 0;
  double timestamp = 0.0;  // seconds
  Rigid3d T_camera_map;
  double scale = 1.0;  // see ScaledPose
  FrameFeaturesPtr features;
  BagOfWordsPtr words;                     // null without place recognition
  std::vector<PointId> points;             // one per keypoint, kNoPoint if none
  std::map<KeyframeId, int> covisibility;  // shared map points per covisible keyframe
  KeyframeId parent = kNoKeyframe;         // the most covisible older keyframe, until Map::Reroot

  ScaledPose Pose() const { return {T_camera_map, scale}; }
  Eigen::Vector3d Center() const { return T_camera_map.Inverse().translation; }

  // Returns the map points that it observes.
  auto SeenPoints() const {
    return points | std::views::filter([](PointId point) { return point != kNoPoint; });
  }

  // Returns the `count` most covisible keyframes, best first.
  std::vector<KeyframeId> BestCovisible(int count) const;

  // Leaves out features and everything that follows from them or from the observations.
  static void VisitState(auto& self, auto&& visit) {
    visit(self.id, self.frame_index, self.timestamp, self.T_camera_map, self.scale, self.covisibility,
          self.parent);
  }
};

// Shifts that make the ids of one run unique beside those of another.
struct IdShift {
  KeyframeId keyframe = 0;
  PointId point = 0;
  int object = 0;
  std::int64_t submap = 0;
  std::int64_t frame = 0;
  double time = 0.0;  // seconds
};

// Keyframes and map points with consistent mutual references. Owned by one thread; others get TrackingView
// and MapSnapshot. Ids are never reused. Iteration is in the order of ids, for repeatable runs.
class Map {
 public:
  // `ids`: shared with the other submaps of a run; null: the map's own.
  explicit Map(const ScaleLevels& levels, std::shared_ptr<IdSource> ids = nullptr);

  KeyframeId AddKeyframe(std::int64_t frame_index, double timestamp, const Rigid3d& T_camera_map,
                         FrameFeaturesPtr features);
  PointId AddPoint(const Eigen::Vector3d& p_map, KeyframeId first_keyframe);

  void AddObservation(PointId point, KeyframeId keyframe, int keypoint);
  void RemoveObservation(PointId point, KeyframeId keyframe);  // and the point if fewer than 2 are left
  void RemovePoint(PointId point);
  void Fuse(PointId dropped, PointId kept);
  void RemoveKeyframe(KeyframeId keyframe);  // its pose stays known, relative to its parent

  // Makes a keyframe the root of its spanning tree, and hangs the tree below `parent`, if given: a keyframe
  // of another tree.
  void Reroot(KeyframeId root, KeyframeId parent = kNoKeyframe);

  // Recompute what follows from the observations.
  void UpdateAppearance(PointId point);      // descriptor, normal, distance range
  void UpdateNormalAndRange(PointId point);  // not the descriptor: for when the point or a camera moved
  void UpdateCovisibility(KeyframeId keyframe);

  // Moves the whole map: p_new = S_new_old * p_old.
  void Transform(const Sim3d& S_new_old);

  // Takes over the content of another map with the same IdSource, which must be in this map's frame already.
  void Absorb(Map&& other);

  void Renumber(const IdShift& shift);  // all ids, and the indices and times of its frames

  bool HasKeyframe(KeyframeId id) const { return keyframes_.contains(id); }
  Keyframe& At(KeyframeId id) { return keyframes_.at(id); }
  const Keyframe& At(KeyframeId id) const { return keyframes_.at(id); }
  MapPoint& Point(PointId id) { return points_.At(id); }  // must be alive
  const MapPoint& Point(PointId id) const { return points_.At(id); }
  bool IsAlive(PointId id) const { return points_.IsAlive(id); }

  const Keypoint& KeypointOf(const Observation& o) const {
    return At(o.keyframe).features->keypoints[o.keypoint];
  }

  // Follows fusions; kNoPoint if the point was removed.
  PointId Resolve(PointId id) const { return points_.Resolve(id); }

  // Returns the pose of a present or removed keyframe.
  ScaledPose PoseOf(KeyframeId id) const;
  bool Knows(KeyframeId id) const { return keyframes_.contains(id) || removed_.contains(id); }

  const std::map<KeyframeId, Keyframe>& Keyframes() const { return keyframes_; }
  const PointTable<MapPoint>& Points() const { return points_; }
  int NumPoints() const { return points_.Size(); }
  const ScaleLevels& Levels() const { return levels_; }
  KeyframeId OldestKeyframe() const { return keyframes_.empty() ? kNoKeyframe : keyframes_.begin()->first; }
  KeyframeId IdBound() const;  // above the ids of all keyframes, including removed ones
  KeyframeId NewestKeyframe() const { return keyframes_.empty() ? kNoKeyframe : keyframes_.rbegin()->first; }

  const RemovedKeyframes& Removed() const { return removed_; }

  static void VisitState(auto& self, auto&& visit) { visit(self.keyframes_, self.removed_, self.points_); }

 private:
  ScaleLevels levels_;
  std::shared_ptr<IdSource> ids_;
  std::map<KeyframeId, Keyframe> keyframes_;
  RemovedKeyframes removed_;
  PointTable<MapPoint> points_;
};

struct ObjectMapView;  // slam/objects/object_types.h

// A map point as the tracking thread sees it.
struct ViewPoint : PointAppearance {
  bool well_observed = false;  // by three or more keyframes
};

struct ViewKeyframe {
  KeyframeId id = kNoKeyframe;
  ScaledPose pose;
  FrameFeaturesPtr features;
  BagOfWordsPtr words;
  std::vector<PointId> points;
  std::vector<KeyframeId> covisible;  // best first
};

// Immutable copy of a submap for the tracking thread. The mapping thread publishes one after each step, so
// that neither thread waits for the other.
struct TrackingView {
  std::int64_t submap = 0;
  std::map<KeyframeId, ViewKeyframe> keyframes;
  RemovedKeyframes removed;
  PointTable<ViewPoint> points;
  bool gravity_known = false;
  std::shared_ptr<const ObjectMapView> objects;

  PointId Resolve(PointId id) const { return points.Resolve(id); }
  bool Has(PointId id) const { return points.IsAlive(id); }
  const ViewPoint& Point(PointId id) const { return points.At(id); }
  bool Knows(KeyframeId id) const { return keyframes.contains(id) || removed.contains(id); }
  ScaledPose PoseOf(KeyframeId id) const {  // of a present or removed keyframe
    return sqslam::PoseOf(removed, id, [this](KeyframeId present) {
      const auto it = keyframes.find(present);
      return it != keyframes.end() ? std::optional(it->second.pose) : std::nullopt;
    });
  }
};

using TrackingViewPtr = std::shared_ptr<const TrackingView>;

TrackingView MakeTrackingView(const Map& map);

// All submaps of a run. A submap begins when tracking is lost and does not recover; it is dormant while
// another one is tracked, and ends when it is merged into an older one.
struct AtlasView {
  // The submap that holds a submap's content now, and the motion of its frame.
  struct Origin {
    std::int64_t submap = 0;
    Sim3d S_map_origin;  // from its initial frame to the present frame of `submap`

    static void VisitState(auto& self, auto&& visit) { visit(self.submap, self.S_map_origin); }
  };
  std::map<std::int64_t, TrackingViewPtr> submaps;
  std::map<std::int64_t, Origin> origins;  // by number, of every submap that ever began
};

using AtlasViewPtr = std::shared_ptr<const AtlasView>;

}  // namespace sqslam
