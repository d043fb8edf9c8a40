#include "slam/mapping/submap.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <unordered_map>

#include "slam/map/map_codec.h"
#include "slam/objects/size_shape.h"
#include "slam/snapshot/snapshot_codec.h"
#include "slam/util/raise_keys.h"

namespace sqslam {

Submap::Submap(std::int64_t number, std::unique_ptr<sqslam::Map> map, const MapperOptions& options)
    : number_(number),
      map_(std::move(map)),
      between_(2 * options.mapping.final_frames),
      // A given gravity is in the frame of the run's first camera, which only submap 0 starts from.
      upright_(number == 0 ? options.gravity : "auto", options.objects.gravity, options.seed),
      objects_(options.objects, options.seed) {
  for (const auto& [id, keyframe] : map_->Keyframes()) {
    RecordFrame(keyframe.frame_index, keyframe.timestamp, {id, {}, keyframe.scale});
  }
}

Submap::Submap(ByteReader& reader, std::unique_ptr<sqslam::Map> map, const Camera& camera,
               const MapperOptions& options)
    : Submap(0, std::move(map), options) {
  reader(number_);
  ReadMap(reader, camera, *map_);
  reader(young_points_);
  reader(frames_);
  reader(upright_);
  objects_.Load(reader);
  std::erase_if(young_points_, [this](PointId point) { return !map_->IsAlive(point); });
  for (const auto& [index, record] : frames_) {
    if (!map_->Knows(record.pose.reference) || !(record.pose.scale > 0.0)) {
      reader.Refuse(fmt::format("has a frame {} whose keyframe is missing or has no positive scale", index));
    }
  }
  if (frames_.empty() || frames_.begin()->first < 0 || map_->Keyframes().empty()) {
    reader.Refuse(fmt::format("has no frames or no keyframes in submap {}", number_));
  }
}

void Submap::Save(ByteWriter& writer) const {
  std::set<PointId> young = young_points_;
  std::erase_if(young, [this](PointId point) { return !map_->IsAlive(point); });
  writer(number_);
  WriteMap(*map_, writer);
  writer(young);
  writer(frames_);
  writer(upright_);
  objects_.Save(writer);
}

void Submap::Renumber(const IdShift& shift) {
  number_ += shift.submap;
  map_->Renumber(shift);
  ShiftKeys(young_points_, shift.point);
  ShiftKeys(frames_, shift.frame);
  for (auto& [index, frame] : frames_) {
    frame.timestamp += shift.time;
    frame.pose.reference += shift.keyframe;
  }
  objects_.Renumber(shift.object, shift.point, shift.frame);
}

void Submap::RecordFrame(std::int64_t index, double timestamp, const AnchoredPose& pose,
                         std::vector<FrameMatch> matches) {
  frames_[index] = {timestamp, pose};
  unrefined_[index] = std::move(matches);
}

void Submap::RefineFrames(const Camera& camera, int min_inliers, int keep) {
  while (static_cast<int>(unrefined_.size()) > keep) {
    auto oldest = unrefined_.extract(unrefined_.begin());
    const std::int64_t index = oldest.key();
    std::vector<FrameMatch>& matches = oldest.mapped();
    FrameRecord& record = frames_.at(index);
    if (matches.empty() || IsKeyframe(index, record)) {
      continue;
    }
    const KeyframeId reference = record.pose.reference;
    const ScaledPose anchor = map_->PoseOf(reference);
    const Rigid3d T_camera_map =
        RefineFrame(*map_, camera, matches, min_inliers, Resolve(record.pose, anchor).T_camera_map);
    record.pose = {reference, T_camera_map * anchor.T_camera_map.Inverse(), anchor.scale};
    between_.Add({index, std::move(matches)});
  }
}

std::vector<BundleFrame> Submap::FramesBetween(int most) const {
  std::map<std::int64_t, const std::vector<FrameMatch>*> known;
  for (const auto& [index, frame] : between_.ByIndex()) {
    known[index] = &frame.matches;
  }
  for (const auto& [index, matches] : unrefined_) {
    if (!matches.empty() && !IsKeyframe(index, frames_.at(index))) {
      known[index] = &matches;
    }
  }
  const std::vector<std::pair<std::int64_t, const std::vector<FrameMatch>*>> frames(known.begin(),
                                                                                    known.end());
  const std::size_t count = std::min(frames.size(), static_cast<std::size_t>(most));
  std::vector<BundleFrame> picked;
  for (std::size_t i = 0; i < count; ++i) {
    const auto& [index, matches] = frames[i * frames.size() / count];
    BundleFrame& frame = picked.emplace_back(BundleFrame{FramePose(index)->Inverse(), {}});
    for (const FrameMatch& match : *matches) {
      frame.matches.push_back({match.point, match.pixel.cast<double>(), match.sigma, match.detected_sigma});
    }
  }
  return picked;
}

bool Submap::IsKeyframe(std::int64_t index, const FrameRecord& record) const {
  const KeyframeId reference = record.pose.reference;
  return map_->HasKeyframe(reference) && map_->At(reference).frame_index == index;
}

Rigid3d Submap::PoseOf(const FrameRecord& record) const {
  return Resolve(record.pose, map_->PoseOf(record.pose.reference)).T_camera_map.Inverse();
}

std::optional<Rigid3d> Submap::FramePose(std::int64_t index) const {
  const auto record = frames_.find(index);
  return record != frames_.end() ? std::optional(PoseOf(record->second)) : std::nullopt;
}

std::vector<TrackedPoint> Submap::PointsIn(std::int64_t index, const Camera& camera) const {
  std::vector<TrackedPoint> points;
  const KeyframeId reference = frames_.at(index).pose.reference;
  if (map_->HasKeyframe(reference) && map_->At(reference).frame_index == index) {
    const Keyframe& keyframe = map_->At(reference);
    for (std::size_t i = 0; i < keyframe.points.size(); ++i) {
      if (const PointId id = keyframe.points[i]; id != kNoPoint) {
        points.push_back({id, keyframe.features->keypoints[i].raw_pixel, map_->Point(id).p_map});
      }
    }
  } else if (const auto matches = unrefined_.find(index); matches != unrefined_.end()) {
    for (const FrameMatch& match : matches->second) {
      if (const PointId id = map_->Resolve(match.point); id != kNoPoint) {
        const Eigen::Vector2d pixel = camera.ProjectDistorted(camera.Unproject(match.pixel.cast<double>()));
        points.push_back({id, pixel, map_->Point(id).p_map});
      }
    }
  }
  return points;
}

std::optional<Rigid3d> Submap::KeepUpright(const Camera& camera, bool last) {
  const std::optional<Rigid3d> T_new_old = upright_.Update(*map_, objects_, camera, last);
  if (T_new_old) {
    Transform(Sim3d::FromRigid(*T_new_old));
  }
  return T_new_old;
}

void Submap::MapObjects(const Camera& camera, bool moved_everywhere) {
  objects_.SetUpright(upright_.Known(), upright_.FindSurfaces(*map_));
  if (moved_everywhere) {
    objects_.Outdate();
  }
  objects_.Update(LookupPoints(), camera, LookupPoses());
}

void Submap::MapObjectsLast(const Camera& camera) {
  objects_.SetUpright(upright_.Known(), upright_.FindSurfaces(*map_));
  objects_.UpdateAll(LookupPoints(), camera, LookupPoses());
}

std::vector<ObjectTerm> Submap::ObjectTerms(const JointObjectOptions& options) const {
  std::vector<ObjectTerm> terms;
  const std::unordered_map<std::int64_t, int> owners = objects_.PointObjects();
  for (const ObjectLandmarkView& object : objects_.View()->landmarks) {
    if (!object.shown || object.observations < options.min_observations) {
      continue;
    }
    ObjectTerm term{object.id, object.superquadric, {}, {}};
    const Rigid3d T_object_map = object.superquadric.T_map_object.Inverse();
    std::vector<Eigen::Vector3d> p_object;
    for (const auto& [id, p_map] : object.points) {
      const auto owner = owners.find(id);
      if (owner != owners.end() && owner->second == object.id && map_->IsAlive(id)) {
        term.points.push_back(id);
        p_object.push_back(T_object_map * map_->Point(id).p_map);
      }
    }
    term.weights = ShapeWeights(p_object);
    terms.push_back(std::move(term));
  }
  return terms;
}

void Submap::CorrectObjects(const std::vector<std::pair<int, PosedSuperquadric>>& corrections,
                            const Camera& camera) {
  for (const auto& [id, superquadric] : corrections) {
    objects_.Correct(id, superquadric, camera);
  }
}

void Submap::Transform(const Sim3d& S_new_old) {
  map_->Transform(S_new_old);
  objects_.Transform(S_new_old);
}

void Submap::Deform(const std::function<void(sqslam::Map&)>& change) {
  std::map<KeyframeId, ScaledPose> before;
  for (const auto& [index, record] : frames_) {
    if (!before.contains(record.pose.reference)) {  // far fewer than frames
      before[record.pose.reference] = map_->PoseOf(record.pose.reference);
    }
  }
  change(*map_);
  objects_.MoveWith([&](std::int64_t frame) {
    // A frame without a record moves like the next one that has one.
    const auto next = frames_.lower_bound(frame);
    const KeyframeId reference = (next != frames_.end() ? next : std::prev(next))->second.pose.reference;
    const ScaledPose& old = before.at(reference);
    const ScaledPose now = map_->PoseOf(reference);
    return Sim3d::FromRigid(now.T_camera_map.Inverse()) *
           Sim3d{now.scale / old.scale, {1, 0, 0, 0}, {0, 0, 0}} * Sim3d::FromRigid(old.T_camera_map);
  });
}

void Submap::Absorb(Submap&& other) {
  map_->Absorb(std::move(*other.map_));
  young_points_.merge(other.young_points_);
  for (auto& [index, matches] : other.unrefined_) {
    if (!frames_.contains(index)) {
      unrefined_.emplace(index, std::move(matches));
    }
  }
  frames_.merge(other.frames_);
  for (const auto& [index, frame] : other.between_.ByIndex()) {
    between_.Add(frame);
  }
  objects_.Absorb(std::move(other.objects_));
}

PointLookup Submap::LookupPoints() const {
  return [this](std::int64_t& id) -> std::optional<Eigen::Vector3d> {
    id = map_->Resolve(id);
    return id == kNoPoint ? std::nullopt : std::optional(map_->Point(id).p_map);
  };
}

PoseLookup Submap::LookupPoses() const {
  return [this](std::int64_t frame_index) { return FramePose(frame_index); };
}

TrackingViewPtr Submap::MakeView() const {
  TrackingView view = MakeTrackingView(*map_);
  view.submap = number_;
  view.gravity_known = upright_.Known();
  view.objects = objects_.View();
  return std::make_shared<const TrackingView>(std::move(view));
}

void Submap::FillSnapshot(MapSnapshot& snapshot) const {
  for (const auto& [id, keyframe] : map_->Keyframes()) {
    snapshot.keyframes.push_back(
        {id, keyframe.frame_index, keyframe.timestamp, keyframe.T_camera_map.Inverse()});
    for (auto it = keyframe.covisibility.upper_bound(id); it != keyframe.covisibility.end(); ++it) {
      snapshot.covisibility.push_back({id, it->first, it->second});
    }
  }
  // Frames placed at the end have higher ids than later frames.
  std::ranges::stable_sort(snapshot.keyframes, {}, &SnapshotKeyframe::timestamp);
  const auto evidence = objects_.Evidence();
  for (const MapPoint& point : map_->Points()) {
    const auto it = evidence.find(point.id);
    const PointEvidence known = it != evidence.end() ? it->second : PointEvidence();
    // Rounded to 1/256: finer steps carry no information and compress badly.
    const auto anomaly = static_cast<float>(std::round(256.0 * known.anomaly) / 256.0);
    snapshot.points.push_back(
        {RecordedPosition(point.p_map), point.rgb, known.object_id, anomaly, known.rejected_by});
  }
  snapshot.objects = objects_.Objects();
  snapshot.gravity_known = upright_.Known();
  snapshot.support_height = upright_.SupportHeight();
}

Trajectory Submap::FrameTrajectory() const {
  Trajectory trajectory;
  for (const auto& [index, record] : frames_) {
    trajectory.push_back({record.timestamp, PoseOf(record)});
  }
  return trajectory;
}

Trajectory Submap::KeyframeTrajectory() const {
  Trajectory trajectory;
  for (const auto& [id, keyframe] : map_->Keyframes()) {
    trajectory.push_back({keyframe.timestamp, keyframe.T_camera_map.Inverse()});
  }
  // Frames placed at the end have higher ids than later frames.
  std::ranges::stable_sort(trajectory, {}, &TimedPose::timestamp);
  return trajectory;
}

}  // namespace sqslam
