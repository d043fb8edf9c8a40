#include "slam/mapping/mapper.h"

#include <algorithm>

#include "slam/estimation/bundle_adjustment.h"
#include "slam/mapping/culling.h"
#include "slam/mapping/fusion.h"
#include "slam/mapping/new_points.h"

namespace sqslam {

Mapper::Mapper(const Camera& camera, const SystemOptions& options, Outputs outputs, StageTimes& times)
    : camera_(camera),
      options_(options),
      outputs_(std::move(outputs)),
      times_(times),
      upright_(options.gravity, options.objects.gravity, static_cast<std::uint64_t>(options.seed)),
      objects_(options.objects, static_cast<std::uint64_t>(options.seed)) {}

void Mapper::Process(TrackingReport report) {
  if (report.initial_map) {
    StartMap(report);
  }
  if (!map_ || report.map_number != map_number_) {
    return;  // of a map that was given up
  }
  RecordFrame(report);
  if (!report.keyframe && !report.initial_map) {
    return;
  }
  const StageTimes::Scope timer(times_, "mapping");
  if (report.keyframe) {
    AddKeyframe(report);
  }
  const KeyframeId newest = map_->NewestKeyframe();
  PublishView();
  OptimizeLocally(newest);
  CullKeyframes(*map_, newest, options_.mapping.culling);
  KeepUpright(false);
  MapObjects();
  PublishView();
  outputs_.publish_snapshot(MakeSnapshot());
}

void Mapper::StartMap(TrackingReport& report) {
  map_ = std::move(report.initial_map);
  map_number_ = report.map_number;
  young_points_.clear();
  frames_.clear();
  upright_ =
      UprightEstimator(options_.gravity, options_.objects.gravity, static_cast<std::uint64_t>(options_.seed));
  objects_ = ObjectMapper(options_.objects, static_cast<std::uint64_t>(options_.seed));
  T_map_origin_ = {};
  const Keyframe& first = map_->Keyframes().begin()->second;
  frames_[first.frame_index] = {first.timestamp, {first.id, {}}};
  frame_index_ = report.frame_index;
  timestamp_ = report.timestamp;
  // A snapshot follows at once: a map of two keyframes is better than none if the run ends here.
  report.initial_map = nullptr;
  const Keyframe& second = map_->Keyframes().rbegin()->second;
  frames_[second.frame_index] = {second.timestamp, {second.id, {}}};
  image_path_ = report.image_path;
  detections_ = report.detections;
  PublishView();
  outputs_.publish_snapshot(MakeSnapshot());
}

void Mapper::RecordFrame(TrackingReport& report) {
  frame_index_ = report.frame_index;
  timestamp_ = report.timestamp;
  image_path_ = std::move(report.image_path);
  detections_ = std::move(report.detections);
  if (report.pose) {
    frames_[report.frame_index] = {report.timestamp, *report.pose};
  }
  for (const PointId point : report.visible) {
    ++map_->Point(point).visible;
  }
  for (const PointId point : report.found) {
    ++map_->Point(point).found;
  }
  // The map may have been turned since the frame was tracked.
  const Rigid3d T_new_old = T_map_origin_ * report.T_map_origin.Inverse();
  for (ObjectObservation& o : report.objects) {
    o.T_map_camera = T_new_old * o.T_map_camera;
    if (o.centroid) {
      o.centroid = T_new_old * *o.centroid;
    }
  }
  objects_.AddObservations(report.objects);
}

void Mapper::AddKeyframe(const TrackingReport& report) {
  const Rigid3d T_camera_map = report.pose->T_camera_reference * map_->PoseOf(report.pose->reference);
  const KeyframeId id =
      map_->AddKeyframe(report.frame_index, report.timestamp, T_camera_map, report.keyframe->features);
  std::set<PointId> used;
  for (std::size_t i = 0; i < report.keyframe->points.size(); ++i) {
    const PointId point = map_->Resolve(report.keyframe->points[i]);
    if (point != kNoPoint && used.insert(point).second) {
      map_->AddObservation(point, id, static_cast<int>(i));
      map_->UpdateAppearance(point);
    }
  }
  map_->UpdateCovisibility(id);
  frames_[report.frame_index].pose = {id, {}};
  {
    const StageTimes::Scope timer(times_, "mapping.new_points");
    CullPoints(*map_, young_points_, id, options_.mapping.culling);
    const std::vector<PointId> created = CreateNewPoints(*map_, camera_, id, options_.mapping.new_points);
    young_points_.insert(created.begin(), created.end());
    FuseWithNeighbours(*map_, camera_, id, options_.mapping.fusion);
  }
}

void Mapper::OptimizeLocally(KeyframeId keyframe) {
  const StageTimes::Scope timer(times_, "mapping.bundle_adjustment");
  if (map_->Keyframes().size() > 2) {
    LocalBundleAdjustment(*map_, camera_, keyframe, options_.mapping.bundle_adjustment,
                          outputs_.keyframe_waiting);
  }
}

void Mapper::KeepUpright(bool last) {
  const auto view = objects_.View();
  const std::optional<Rigid3d> T_new_old = upright_.Update(*map_, view->landmarks, last);
  if (T_new_old) {
    map_->Transform(*T_new_old);
    objects_.Transform(*T_new_old);
    T_map_origin_ = *T_new_old * T_map_origin_;
  }
}

void Mapper::MapObjects() {
  const StageTimes::Scope timer(times_, "mapping.objects");
  objects_.SetUpright(upright_.Known(), upright_.SupportHeight());
  objects_.Update(LookupPoints(), camera_, LookupPoses());
}

MapSnapshotPtr Mapper::Finish() {
  if (!map_) {
    return nullptr;
  }
  const StageTimes::Scope timer(times_, "mapping.final");
  if (options_.mapping.final_iterations > 0 && map_->Keyframes().size() > 2) {
    GlobalBundleAdjustment(*map_, camera_, options_.mapping.final_iterations,
                           options_.mapping.bundle_adjustment);
  }
  KeepUpright(true);
  objects_.SetUpright(upright_.Known(), upright_.SupportHeight());
  objects_.UpdateAll(LookupPoints(), camera_, LookupPoses());
  MapSnapshotPtr last = MakeSnapshot();
  outputs_.publish_snapshot(last);
  return last;
}

PointLookup Mapper::LookupPoints() {
  return [this](std::int64_t& id) -> std::optional<Eigen::Vector3d> {
    id = map_->Resolve(id);
    if (id == kNoPoint) {
      return std::nullopt;
    }
    return map_->Point(id).p_map;
  };
}

PoseLookup Mapper::LookupPoses() const {
  return [this](std::int64_t frame_index) -> std::optional<Rigid3d> {
    const auto it = frames_.find(frame_index);
    return it != frames_.end() ? std::optional(FramePose(it->second)) : std::nullopt;
  };
}

Rigid3d Mapper::FramePose(const FrameRecord& record) const {
  return (record.pose.T_camera_reference * map_->PoseOf(record.pose.reference)).Inverse();
}

Trajectory Mapper::FrameTrajectory() const {
  Trajectory trajectory;
  for (const auto& [index, record] : frames_) {
    trajectory.push_back({record.timestamp, FramePose(record)});
  }
  return trajectory;
}

Trajectory Mapper::KeyframeTrajectory() const {
  Trajectory trajectory;
  if (map_) {
    for (const auto& [id, keyframe] : map_->Keyframes()) {
      trajectory.push_back({keyframe.timestamp, keyframe.T_camera_map.Inverse()});
    }
  }
  return trajectory;
}

void Mapper::PublishView() {
  TrackingView view = MakeTrackingView(*map_);
  view.map_number = map_number_;
  view.T_map_origin = T_map_origin_;
  view.gravity_known = upright_.Known();
  view.objects = objects_.View();
  outputs_.publish_view(std::make_shared<const TrackingView>(std::move(view)));
}

MapSnapshotPtr Mapper::MakeSnapshot() const {
  auto snapshot = std::make_shared<MapSnapshot>();
  snapshot->sequence_number = snapshots_++;
  snapshot->frame_index = frame_index_;
  snapshot->timestamp = timestamp_;
  snapshot->image_path = image_path_;
  snapshot->camera = camera_;
  if (const auto it = frames_.find(frame_index_); it != frames_.end()) {
    snapshot->T_map_camera = FramePose(it->second);
  }
  for (const auto& [id, keyframe] : map_->Keyframes()) {
    snapshot->keyframes.push_back(
        {id, keyframe.frame_index, keyframe.timestamp, keyframe.T_camera_map.Inverse()});
  }
  const auto object_of = objects_.PointObjects();
  for (const MapPoint& point : map_->Points()) {
    if (point.alive) {
      const auto it = object_of.find(point.id);
      snapshot->points.push_back(
          {point.p_map.cast<float>(), point.rgb, it != object_of.end() ? it->second : -1});
    }
  }
  snapshot->objects = objects_.Objects();
  snapshot->detections = detections_;
  snapshot->gravity_known = upright_.Known();
  snapshot->support_height = upright_.SupportHeight();
  return snapshot;
}

}  // namespace sqslam
