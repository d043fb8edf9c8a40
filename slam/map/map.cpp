#include "slam/map/map.h"

#include <algorithm>
#include <limits>
#include <ranges>
#include <utility>

#include "slam/features/matching.h"
#include "slam/util/raise_keys.h"
#include "slam/util/statistics.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace {

constexpr int kMinSharedPoints = 15;  // for two keyframes to be covisible

// Returns the descriptor with the least median distance to the others.
Descriptor MedianDescriptor(const std::vector<const Descriptor*>& descriptors) {
  std::size_t best = 0;
  int best_median = std::numeric_limits<int>::max();
  std::vector<int> distances(descriptors.size());
  for (std::size_t i = 0; i < descriptors.size(); ++i) {
    for (std::size_t j = 0; j < descriptors.size(); ++j) {
      distances[j] = i == j ? 0 : HammingDistance(*descriptors[i], *descriptors[j]);
    }
    const int median = NthSmallest(distances, (distances.size() - 1) / 2);
    if (median < best_median) {
      best_median = median;
      best = i;
    }
  }
  return *descriptors[best];
}

// Returns true if the spanning tree has the keyframe at or below `ancestor`. Ends in the circle that a map
// from a file may have in place of a tree, too.
bool IsBelow(const Map& map, KeyframeId id, KeyframeId ancestor) {
  for (std::size_t i = 0; i < map.Keyframes().size() && id != ancestor && id != kNoKeyframe; ++i) {
    id = map.At(id).parent;
  }
  return id == ancestor;
}

}  // namespace

std::optional<PredictedSight> PredictSight(const PointAppearance& point, const Camera& camera,
                                           const Rigid3d& T_camera_map, const Eigen::Vector3d& center) {
  constexpr double kMinCosine = 0.5;
  const Eigen::Vector3d p_camera = T_camera_map * point.p_map;
  if (p_camera.z() <= 0.0) {
    return std::nullopt;
  }
  const Eigen::Vector2d pixel = camera.Project(p_camera);
  const Eigen::Vector3d ray = point.p_map - center;
  const double distance = ray.norm();
  const double cosine = ray.dot(point.normal) / distance;
  const bool in_range = distance >= point.min_distance && distance <= point.max_distance;
  return camera.Shows(pixel) && in_range && cosine >= kMinCosine
             ? std::optional(PredictedSight{pixel, distance, cosine})
             : std::nullopt;
}

bool MapPoint::IsSeenBy(KeyframeId keyframe) const {
  return std::ranges::find(observations, keyframe, &Observation::keyframe) != observations.end();
}

std::vector<KeyframeId> Keyframe::BestCovisible(int count) const {
  auto sorted = ToVector(covisibility, [](const auto& edge) { return std::pair(edge.second, edge.first); });
  std::ranges::sort(sorted, std::greater<>());
  return ToVector(sorted | std::views::take(count) | std::views::values);
}

Map::Map(const ScaleLevels& levels, std::shared_ptr<IdSource> ids)
    : levels_(levels), ids_(ids ? std::move(ids) : std::make_shared<IdSource>()) {}

KeyframeId Map::AddKeyframe(std::int64_t frame_index, double timestamp, const Rigid3d& T_camera_map,
                            FrameFeaturesPtr features) {
  const KeyframeId id = ids_->next_keyframe++;
  Keyframe& keyframe = keyframes_[id];
  keyframe.id = id;
  keyframe.frame_index = frame_index;
  keyframe.timestamp = timestamp;
  keyframe.T_camera_map = T_camera_map;
  keyframe.points.assign(features->Size(), kNoPoint);
  keyframe.features = std::move(features);
  return id;
}

PointId Map::AddPoint(const Eigen::Vector3d& p_map, KeyframeId first_keyframe) {
  MapPoint point;
  point.id = ids_->next_point++;
  point.p_map = p_map;
  point.first_keyframe = first_keyframe;
  const PointId id = point.id;
  points_.Add(id, std::move(point));
  return id;
}

void Map::AddObservation(PointId point, KeyframeId keyframe, int keypoint) {
  Point(point).observations.push_back({keyframe, keypoint});
  At(keyframe).points[keypoint] = point;
}

void Map::RemoveObservation(PointId point, KeyframeId keyframe) {
  if (!IsAlive(point)) {
    return;
  }
  auto& observations = Point(point).observations;
  const auto it = std::ranges::find(observations, keyframe, &Observation::keyframe);
  if (it == observations.end()) {
    return;
  }
  At(keyframe).points[it->keypoint] = kNoPoint;
  observations.erase(it);
  if (observations.size() < 2) {
    RemovePoint(point);
  }
}

void Map::RemovePoint(PointId id) {
  if (!IsAlive(id)) {
    return;
  }
  for (const Observation& o : Point(id).observations) {
    At(o.keyframe).points[o.keypoint] = kNoPoint;
  }
  points_.Remove(id);
}

void Map::Fuse(PointId dropped, PointId kept) {
  if (dropped == kept || !IsAlive(dropped) || !IsAlive(kept)) {
    return;
  }
  const std::vector<Observation> moved = std::move(Point(dropped).observations);
  Point(kept).visible += Point(dropped).visible;
  Point(kept).found += Point(dropped).found;
  points_.Remove(dropped, kept);
  for (const Observation& o : moved) {
    At(o.keyframe).points[o.keypoint] = kNoPoint;
    if (!Point(kept).IsSeenBy(o.keyframe)) {
      AddObservation(kept, o.keyframe, o.keypoint);
    }
  }
  UpdateAppearance(kept);
}

void Map::RemoveKeyframe(KeyframeId id) {
  const Keyframe& keyframe = At(id);
  if (keyframe.parent == kNoKeyframe) {
    const auto best = keyframe.BestCovisible(1);
    const KeyframeId oldest = keyframes_.begin()->first;
    const KeyframeId heir = !best.empty()  ? best.front()
                            : oldest != id ? oldest
                                           : std::next(keyframes_.begin())->first;
    Reroot(heir);
    if (keyframe.parent == kNoKeyframe) {  // the heir is in another tree
      Reroot(id, heir);
    }
  }
  const KeyframeId parent = keyframe.parent;
  const Keyframe& anchor = At(parent);
  removed_[id] = {{parent, keyframe.T_camera_map * anchor.T_camera_map.Inverse(), anchor.scale},
                  keyframe.scale};
  for (const PointId point : std::vector(keyframe.points)) {
    RemoveObservation(point, id);
  }
  for (const auto& [other, weight] : At(id).covisibility) {
    At(other).covisibility.erase(id);
  }
  keyframes_.erase(id);
  for (auto& [other_id, other] : keyframes_) {
    if (other.parent == id) {
      other.parent = parent;
    }
  }
}

void Map::Reroot(KeyframeId root, KeyframeId parent) {
  for (KeyframeId id = root; id != kNoKeyframe;) {  // turns the edges on the way up
    const KeyframeId next = std::exchange(At(id).parent, parent);
    parent = std::exchange(id, next);
  }
}

void Map::UpdateAppearance(PointId id) {
  if (!IsAlive(id) || Point(id).observations.empty()) {
    return;
  }
  MapPoint& point = Point(id);
  const std::vector<const Descriptor*> descriptors = ToVector(point.observations, [&](const Observation& o) {
    return &At(o.keyframe).features->descriptors[o.keypoint];
  });
  point.descriptor = MedianDescriptor(descriptors);
  const Observation& first = point.observations.front();
  point.rgb = At(first.keyframe).features->colors[first.keypoint];
  UpdateNormalAndRange(id);
}

void Map::UpdateNormalAndRange(PointId id) {
  // A point may be matched 25 % nearer or farther than the pyramid covers.
  constexpr double kRangeFactor = 1.25;
  if (!IsAlive(id) || Point(id).observations.empty()) {
    return;
  }
  MapPoint& point = Point(id);
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  for (const Observation& o : point.observations) {
    normal += (point.p_map - At(o.keyframe).Center()).normalized();
  }
  point.normal = normal.normalized();
  const Observation& first = point.observations.front();
  const double distance = (point.p_map - At(first.keyframe).Center()).norm();
  point.level_zero_distance = distance * levels_.Scale(KeypointOf(first).octave);
  point.max_distance = kRangeFactor * point.level_zero_distance;
  point.min_distance = point.level_zero_distance / levels_.Scale(levels_.Count() - 1) / kRangeFactor;
}

void Map::UpdateCovisibility(KeyframeId id) {
  Keyframe& keyframe = At(id);
  std::map<KeyframeId, int> shared;
  for (const PointId point : keyframe.SeenPoints()) {
    for (const Observation& o : Point(point).observations) {
      if (o.keyframe != id) {
        ++shared[o.keyframe];
      }
    }
  }
  for (const auto& [other, weight] : keyframe.covisibility) {
    At(other).covisibility.erase(id);
  }
  keyframe.covisibility.clear();
  if (shared.empty()) {
    return;
  }
  const auto most = std::ranges::max_element(shared, {}, &std::pair<const KeyframeId, int>::second);
  for (const auto& [other, weight] : shared) {
    if (weight >= kMinSharedPoints || other == most->first) {
      keyframe.covisibility[other] = weight;
      At(other).covisibility[id] = weight;
    }
  }
  if (keyframe.parent == kNoKeyframe) {
    int best = 0;
    for (const auto& [other, weight] : shared) {
      if (other < id && weight > best && !IsBelow(*this, other, id)) {
        best = weight;
        keyframe.parent = other;
      }
    }
  }
}

void Map::Transform(const Sim3d& S_new_old) {
  for (auto& [id, keyframe] : keyframes_) {
    keyframe.T_camera_map = MoveCamera(keyframe.T_camera_map, S_new_old);
    keyframe.scale *= S_new_old.scale;
  }
  for (const MapPoint& const_point : points_) {
    MapPoint& point = Point(const_point.id);
    point.p_map = S_new_old * point.p_map;
    point.normal = S_new_old.rotation * point.normal;
    point.min_distance *= S_new_old.scale;
    point.max_distance *= S_new_old.scale;
    point.level_zero_distance *= S_new_old.scale;
  }
}

KeyframeId Map::IdBound() const {
  return std::max(NewestKeyframe(), removed_.empty() ? kNoKeyframe : removed_.rbegin()->first) + 1;
}

void Map::Absorb(Map&& other) {
  keyframes_.merge(other.keyframes_);
  removed_.merge(other.removed_);
  points_.Absorb(std::move(other.points_));
}

void Map::Renumber(const IdShift& shift) {
  ShiftKeys(keyframes_, shift.keyframe);
  for (auto& [id, keyframe] : keyframes_) {
    keyframe.id += shift.keyframe;
    keyframe.parent += keyframe.parent == kNoKeyframe ? 0 : shift.keyframe;
    keyframe.frame_index += shift.frame;
    keyframe.timestamp += shift.time;
    ShiftKeys(keyframe.covisibility, shift.keyframe);
    for (PointId& point : keyframe.points) {
      point += point == kNoPoint ? 0 : shift.point;
    }
  }
  ShiftKeys(removed_, shift.keyframe);
  for (auto& [id, removed] : removed_) {
    removed.pose.reference += shift.keyframe;
  }
  points_.RaiseIds(shift.point);
  for (const MapPoint& const_point : points_) {
    MapPoint& point = points_.At(const_point.id + shift.point);
    point.id += shift.point;
    point.first_keyframe += shift.keyframe;
    for (Observation& o : point.observations) {
      o.keyframe += shift.keyframe;
    }
  }
}

ScaledPose Map::PoseOf(KeyframeId id) const {
  return sqslam::PoseOf(removed_, id, [this](KeyframeId present) {
    const auto it = keyframes_.find(present);
    return it != keyframes_.end() ? std::optional(it->second.Pose()) : std::nullopt;
  });
}

TrackingView MakeTrackingView(const Map& map) {
  constexpr int kNeighbours = 10;
  constexpr std::size_t kWellObserved = 3;
  TrackingView view;
  for (const auto& [id, keyframe] : map.Keyframes()) {
    view.keyframes[id] = {id,
                          keyframe.Pose(),
                          keyframe.features,
                          keyframe.words,
                          keyframe.points,
                          keyframe.BestCovisible(kNeighbours)};
  }
  view.removed = map.Removed();
  view.points = map.Points().Map<ViewPoint>([](const MapPoint& point) {
    return ViewPoint{point, point.observations.size() >= kWellObserved};
  });
  return view;
}

}  // namespace sqslam
