#include "slam/map/map.h"

#include <algorithm>
#include <limits>

#include "slam/features/matching.h"

namespace sqslam {
namespace {

constexpr int kMinSharedPoints = 15;  // for two keyframes to count as covisible

// The observed descriptor with the least median distance to the others.
Descriptor MedianDescriptor(const std::vector<const Descriptor*>& descriptors) {
  std::size_t best = 0;
  int best_median = std::numeric_limits<int>::max();
  std::vector<int> distances(descriptors.size());
  for (std::size_t i = 0; i < descriptors.size(); ++i) {
    for (std::size_t j = 0; j < descriptors.size(); ++j) {
      distances[j] = i == j ? 0 : HammingDistance(*descriptors[i], *descriptors[j]);
    }
    const auto middle = distances.begin() + static_cast<std::ptrdiff_t>((distances.size() - 1) / 2);
    std::nth_element(distances.begin(), middle, distances.end());
    if (*middle < best_median) {
      best_median = *middle;
      best = i;
    }
  }
  return *descriptors[best];
}

}  // namespace

std::vector<KeyframeId> Keyframe::BestCovisible(int count) const {
  std::vector<std::pair<int, KeyframeId>> sorted;
  for (const auto& [other, weight] : covisibility) {
    sorted.emplace_back(weight, other);
  }
  std::sort(sorted.begin(), sorted.end(), std::greater<>());
  std::vector<KeyframeId> best;
  for (const auto& [weight, other] : sorted) {
    if (static_cast<int>(best.size()) == count) {
      break;
    }
    best.push_back(other);
  }
  return best;
}

KeyframeId Map::AddKeyframe(std::int64_t frame_index, double timestamp, const Rigid3d& T_camera_map,
                            FrameFeaturesPtr features) {
  const KeyframeId id = next_keyframe_++;
  Keyframe keyframe{id, frame_index, timestamp, T_camera_map, std::move(features), {}, {}, kNoKeyframe};
  keyframe.points.assign(keyframe.features->Size(), kNoPoint);
  keyframes_.emplace(id, std::move(keyframe));
  return id;
}

PointId Map::AddPoint(const Eigen::Vector3d& p_map, KeyframeId first_keyframe) {
  MapPoint point;
  point.id = static_cast<PointId>(points_.size());
  point.p_map = p_map;
  point.first_keyframe = first_keyframe;
  points_.push_back(std::move(point));
  ++alive_points_;
  return points_.back().id;
}

void Map::AddObservation(PointId point, KeyframeId keyframe, int keypoint) {
  Point(point).observations.push_back({keyframe, keypoint});
  At(keyframe).points[static_cast<std::size_t>(keypoint)] = point;
}

void Map::RemoveObservation(PointId point, KeyframeId keyframe) {
  auto& observations = Point(point).observations;
  const auto it = std::find_if(observations.begin(), observations.end(),
                               [&](const Observation& o) { return o.keyframe == keyframe; });
  if (it == observations.end()) {
    return;
  }
  At(keyframe).points[static_cast<std::size_t>(it->keypoint)] = kNoPoint;
  observations.erase(it);
  if (observations.size() < 2) {
    RemovePoint(point);
  }
}

void Map::RemovePoint(PointId id) {
  MapPoint& point = Point(id);
  if (!point.alive) {
    return;
  }
  for (const Observation& o : point.observations) {
    At(o.keyframe).points[static_cast<std::size_t>(o.keypoint)] = kNoPoint;
  }
  point.observations.clear();
  point.alive = false;
  --alive_points_;
}

void Map::Fuse(PointId dropped, PointId kept) {
  if (dropped == kept || !IsAlive(dropped) || !IsAlive(kept)) {
    return;
  }
  const std::vector<Observation> moved = Point(dropped).observations;
  Point(kept).visible += Point(dropped).visible;
  Point(kept).found += Point(dropped).found;
  RemovePoint(dropped);
  Point(dropped).replaced_by = kept;
  for (const Observation& o : moved) {
    const auto& seen = Point(kept).observations;
    if (std::none_of(seen.begin(), seen.end(),
                     [&](const Observation& s) { return s.keyframe == o.keyframe; })) {
      AddObservation(kept, o.keyframe, o.keypoint);
    }
  }
  UpdateAppearance(kept);
}

void Map::RemoveKeyframe(KeyframeId id) {
  const Keyframe& keyframe = At(id);
  KeyframeId parent = keyframe.parent;
  if (parent == kNoKeyframe || !HasKeyframe(parent)) {
    const auto best = keyframe.BestCovisible(1);
    parent = best.empty() ? (keyframes_.begin()->first == id ? std::next(keyframes_.begin())->first
                                                             : keyframes_.begin()->first)
                          : best.front();
  }
  removed_[id] = {parent, keyframe.T_camera_map * At(parent).T_camera_map.Inverse()};
  const std::vector<PointId> points = keyframe.points;
  for (const PointId point : points) {
    if (point != kNoPoint) {
      RemoveObservation(point, id);
    }
  }
  for (const auto& [other, weight] : At(id).covisibility) {
    At(other).covisibility.erase(id);
  }
  keyframes_.erase(id);
  for (auto& [other_id, other] : keyframes_) {
    if (other.parent == id) {
      other.parent = parent == other_id ? kNoKeyframe : parent;
    }
  }
}

void Map::UpdateAppearance(PointId id) {
  MapPoint& point = Point(id);
  if (!point.alive || point.observations.empty()) {
    return;
  }
  std::vector<const Descriptor*> descriptors;
  for (const Observation& o : point.observations) {
    descriptors.push_back(&At(o.keyframe).features->descriptors[static_cast<std::size_t>(o.keypoint)]);
  }
  point.descriptor = MedianDescriptor(descriptors);
  const Observation& first = point.observations.front();
  point.rgb = At(first.keyframe).features->colors[static_cast<std::size_t>(first.keypoint)];
  UpdateNormalAndRange(id);
}

void Map::UpdateNormalAndRange(PointId id) {
  // A point may be matched one and a half pyramid levels nearer or farther than the pyramid covers.
  constexpr double kSlack = 1.25;
  MapPoint& point = Point(id);
  if (!point.alive || point.observations.empty()) {
    return;
  }
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  for (const Observation& o : point.observations) {
    normal += (point.p_map - At(o.keyframe).Center()).normalized();
  }
  point.normal = normal.normalized();
  const Observation& first = point.observations.front();
  const Keyframe& keyframe = At(first.keyframe);
  const double distance = (point.p_map - keyframe.Center()).norm();
  const int octave = keyframe.features->keypoints[static_cast<std::size_t>(first.keypoint)].octave;
  const double at_level_zero = distance * levels_.Scale(octave);
  point.max_distance = kSlack * at_level_zero;
  point.min_distance = at_level_zero / levels_.Scale(levels_.Count() - 1) / kSlack;
}

void Map::UpdateCovisibility(KeyframeId id) {
  Keyframe& keyframe = At(id);
  std::map<KeyframeId, int> shared;
  for (const PointId point : keyframe.points) {
    if (point == kNoPoint) {
      continue;
    }
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
  const auto most = std::max_element(shared.begin(), shared.end(),
                                     [](const auto& a, const auto& b) { return a.second < b.second; });
  for (const auto& [other, weight] : shared) {
    if (weight >= kMinSharedPoints || other == most->first) {
      keyframe.covisibility[other] = weight;
      At(other).covisibility[id] = weight;
    }
  }
  if (keyframe.parent == kNoKeyframe) {
    int best = 0;
    for (const auto& [other, weight] : shared) {
      if (other < id && weight > best) {
        best = weight;
        keyframe.parent = other;
      }
    }
  }
}

void Map::Transform(const Rigid3d& T_new_old) {
  const Rigid3d T_old_new = T_new_old.Inverse();
  for (auto& [id, keyframe] : keyframes_) {
    keyframe.T_camera_map = keyframe.T_camera_map * T_old_new;
  }
  for (MapPoint& point : points_) {
    point.p_map = T_new_old * point.p_map;
    point.normal = T_new_old.rotation * point.normal;
  }
}

PointId Map::Resolve(PointId id) const {
  while (id != kNoPoint && !Point(id).alive) {
    id = Point(id).replaced_by;
  }
  return id;
}

Rigid3d Map::PoseOf(KeyframeId id) const {
  if (const auto it = keyframes_.find(id); it != keyframes_.end()) {
    return it->second.T_camera_map;
  }
  const RemovedKeyframe& removed = removed_.at(id);
  return removed.T_camera_parent * PoseOf(removed.parent);
}

}  // namespace sqslam
