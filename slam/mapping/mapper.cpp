#include "slam/mapping/mapper.h"

#include <algorithm>
#include <set>

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
      pose_tracker_(camera, options.tracking) {}

void Mapper::Process(TrackingReport report) {
  const bool is_new = report.initial_map != nullptr;
  if (is_new) {
    BeginSubmap(report);
  }
  active_ = Activate(report);
  if (active_ == nullptr) {
    return;  // nothing has been mapped yet
  }
  RecordFrame(report);
  if (!report.keyframe && !is_new) {
    return;
  }
  const StageTimes::Scope timer(times_, "mapping");
  const KeyframeId newest = is_new ? active_->Map().NewestKeyframe() : AddKeyframe(report);
  PublishView();
  if (is_new) {
    outputs_.publish_snapshot(MakeSnapshot());  // two keyframes are better than none if the run ends here
  }
  OptimizeLocally(newest);
  CullKeyframes(active_->Map(), newest, options_.mapping.culling);
  KeepUpright(false);
  {
    const StageTimes::Scope objects_timer(times_, "mapping.objects");
    active_->MapObjects(camera_, false);
  }
  PublishView();
  TrackBacklog();
  outputs_.publish_snapshot(MakeSnapshot());
}

void Mapper::BeginSubmap(TrackingReport& report) {
  submaps_.emplace(report.submap, Submap(report.submap, std::move(report.initial_map), options_));
  atlas_.origins[report.submap] = {report.submap, {}};
}

// The submap that the report is about, which may have been merged into another one meanwhile.
Submap* Mapper::Activate(const TrackingReport& report) {
  const auto origin = atlas_.origins.find(report.submap);
  return origin != atlas_.origins.end() ? &submaps_.at(origin->second.submap) : active_;
}

void Mapper::RecordFrame(TrackingReport& report) {
  frame_index_ = report.frame_index;
  timestamp_ = report.timestamp;
  image_path_ = std::move(report.image_path);
  detections_ = std::move(report.detections);
  if (!report.pose) {
    return;
  }
  active_->RecordFrame(report.frame_index, report.timestamp, *report.pose);
  Map& map = active_->Map();
  for (PointId point : report.seen.visible) {
    if ((point = map.Resolve(point)) != kNoPoint) {
      ++map.Point(point).visible;
    }
  }
  for (PointId point : report.seen.found) {
    if ((point = map.Resolve(point)) != kNoPoint) {
      ++map.Point(point).found;
    }
  }
  // The map may have been moved since the frame was tracked.
  const Sim3d S_new_old = atlas_.origins.at(report.submap).S_map_origin * report.S_map_origin.Inverse();
  for (ObjectObservation& o : report.objects) {
    o.T_map_camera = {(S_new_old.rotation * o.T_map_camera.rotation).normalized(),
                      S_new_old * o.T_map_camera.translation};
    if (o.centroid) {
      o.centroid = S_new_old * *o.centroid;
    }
  }
  active_->Objects().AddObservations(report.objects);
  if (report.backlog) {
    backlog_ = std::move(report.backlog);
  }
}

KeyframeId Mapper::AddKeyframe(const TrackingReport& report) {
  Map& map = active_->Map();
  const ScaledPose pose = Resolve(*report.pose, map.PoseOf(report.pose->reference));
  const KeyframeId id =
      map.AddKeyframe(report.frame_index, report.timestamp, pose.T_camera_map, report.keyframe->features);
  std::set<PointId> used;
  for (std::size_t i = 0; i < report.keyframe->points.size(); ++i) {
    const PointId point = map.Resolve(report.keyframe->points[i]);
    if (point != kNoPoint && used.insert(point).second) {
      map.AddObservation(point, id, static_cast<int>(i));
      map.UpdateAppearance(point);
    }
  }
  map.UpdateCovisibility(id);
  active_->RecordFrame(report.frame_index, report.timestamp, {id, {}, map.At(id).scale});
  {
    const StageTimes::Scope timer(times_, "mapping.new_points");
    CullPoints(map, active_->YoungPoints(), id, options_.mapping.culling);
    const std::vector<PointId> created = CreateNewPoints(map, camera_, id, options_.mapping.new_points);
    active_->YoungPoints().insert(created.begin(), created.end());
    FuseWithNeighbours(map, camera_, id, options_.mapping.fusion);
  }
  return id;
}

void Mapper::OptimizeLocally(KeyframeId keyframe) {
  const StageTimes::Scope timer(times_, "mapping.bundle_adjustment");
  if (active_->Map().Keyframes().size() > 2) {
    LocalBundleAdjustment(active_->Map(), camera_, keyframe, options_.mapping.bundle_adjustment,
                          outputs_.keyframe_waiting);
  }
}

void Mapper::KeepUpright(bool last) {
  if (const std::optional<Rigid3d> T_new_old = active_->KeepUpright(last)) {
    const Sim3d S_new_old{1.0, T_new_old->rotation, T_new_old->translation};
    for (auto& [number, origin] : atlas_.origins) {
      if (origin.submap == active_->Number()) {
        origin.S_map_origin = S_new_old * origin.S_map_origin;
      }
    }
  }
}

// The frames before the map was there, as soon as it is solid enough to find them.
void Mapper::TrackBacklog() {
  constexpr std::size_t kSolid = 4;  // keyframes
  if (!backlog_ || active_->Map().Keyframes().size() < kSolid) {
    return;
  }
  const StageTimes::Scope timer(times_, "mapping.backlog");
  const TrackingViewPtr view = active_->MakeView();
  if (view->Knows(backlog_->next.anchor.reference)) {
    for (const TrackedFrame& frame :
         TrackBackward(pose_tracker_, *view, *backlog_, options_.tracking.min_inliers)) {
      if (!IsAnywhere(frame.index)) {
        active_->RecordFrame(frame.index, frame.timestamp, frame.anchor);
      }
    }
  }
  backlog_.reset();
}

bool Mapper::IsAnywhere(std::int64_t frame_index) const {
  return std::any_of(submaps_.begin(), submaps_.end(),
                     [&](const auto& entry) { return entry.second.HasFrame(frame_index); });
}

void Mapper::FinishSubmap(Submap& submap) {
  active_ = &submap;
  if (options_.mapping.final_iterations > 0 && submap.Map().Keyframes().size() > 2) {
    GlobalBundleAdjustment(submap.Map(), camera_, options_.mapping.final_iterations,
                           options_.mapping.bundle_adjustment);
  }
  KeepUpright(true);
  submap.MapObjects(camera_, true);
}

std::vector<FinishedMap> Mapper::Finish() {
  if (submaps_.empty()) {
    return {};
  }
  const StageTimes::Scope timer(times_, "mapping.final");
  TrackBacklog();
  std::vector<Submap*> ranked;
  for (auto& [number, submap] : submaps_) {
    ranked.push_back(&submap);
  }
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const Submap* a, const Submap* b) { return a->NumFrames() > b->NumFrames(); });
  std::vector<FinishedMap> finished;
  for (Submap* submap : ranked) {
    const auto keyframes = static_cast<int>(submap->Map().Keyframes().size());
    if (!finished.empty() && keyframes < options_.mapping.min_submap_keyframes) {
      ++counts_.resets;
      continue;
    }
    FinishSubmap(*submap);
    finished.push_back({MakeSnapshot(), submap->FrameTrajectory(), submap->KeyframeTrajectory()});
  }
  outputs_.publish_snapshot(finished.front().snapshot);
  return finished;
}

void Mapper::PublishView() {
  atlas_.submaps[active_->Number()] = active_->MakeView();
  outputs_.publish_atlas(std::make_shared<const AtlasView>(atlas_));
}

MapSnapshotPtr Mapper::MakeSnapshot() const {
  auto snapshot = std::make_shared<MapSnapshot>();
  snapshot->sequence_number = snapshots_++;
  snapshot->frame_index = frame_index_;
  snapshot->timestamp = timestamp_;
  snapshot->image_path = image_path_;
  snapshot->camera = camera_;
  snapshot->T_map_camera = active_->FramePose(frame_index_);
  snapshot->detections = detections_;
  active_->FillSnapshot(*snapshot);
  return snapshot;
}

}  // namespace sqslam
