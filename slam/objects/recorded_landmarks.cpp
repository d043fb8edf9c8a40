#include "slam/objects/recorded_landmarks.h"

#include <cmath>

#include "slam/objects/detection_filter.h"

namespace sqslam {
namespace {

// Adds the snapshot's boxes, with their free edges, to their landmarks.
void AddViews(const MapSnapshot& snapshot, const Rigid3d& T_map_camera, const ObjectOptions& options,
              std::map<int, Landmark>& landmarks) {
  ObjectFrame frame{snapshot.frame_index, T_map_camera, snapshot.camera, {}, {}, {}};
  for (const SnapshotDetection& detection : snapshot.detections) {
    frame.detections.push_back(detection.detection);
  }
  for (const BoxCandidate& box : SelectBoxes(frame, options.detections, options.outliers.depth_iqr)) {
    const int id = snapshot.detections[static_cast<std::size_t>(box.detection_index)].object_id;
    const auto landmark = landmarks.find(id);
    if (landmark == landmarks.end()) {
      continue;
    }
    landmark->second.views.push_back(
        {snapshot.frame_index, T_map_camera, box.detection.box, box.FreeEdges()});
  }
}

Landmark LandmarkOf(const SnapshotObject& object, const SupportSurfaces& supports) {
  Landmark landmark;
  landmark.id = object.id;
  landmark.labels.Add(object.label, object.score);
  landmark.observations = object.observations;
  landmark.estimated = true;
  landmark.refined = true;
  landmark.superquadric = object.superquadric;
  landmark.visible = object.superquadric;
  landmark.covariance = object.fit.covariance;
  landmark.reliability = object.fit.reliability;
  landmark.box_agreement = object.fit.box_agreement;
  const double bottom =
      object.superquadric.T_map_object.translation.z() - object.superquadric.shape.half_size.z();
  double nearest = 2.0 * supports.Tolerance();
  for (const SupportSurface& surface : supports.All()) {
    if (std::abs(surface.height - bottom) < nearest) {
      nearest = std::abs(surface.height - bottom);
      landmark.support = surface.height;
    }
  }
  return landmark;
}

}  // namespace

void SetPoints(const MapSnapshot& map, Landmark& landmark, const std::function<bool(std::size_t)>& is_own) {
  landmark.points.clear();
  landmark.votes.clear();
  for (std::size_t i = 0; i < map.points.size(); ++i) {
    if (!is_own(i)) {
      continue;
    }
    const auto point = static_cast<std::int64_t>(i);
    const Eigen::Vector3d p_map = map.points[i].p_map.cast<double>();
    landmark.points.emplace_back(point, p_map);
    Landmark::PointVotes& votes = landmark.votes[point];
    for (const BoxView& view : landmark.views) {
      const Eigen::Vector3d p = view.T_map_camera.Inverse() * p_map;
      if (p.z() > 0.0 && view.box.Contains(map.camera.ProjectDistorted(p), 0.0)) {
        votes.SeeInside(view.T_map_camera.translation);
      }
    }
  }
}

std::map<int, Landmark> RecordedLandmarks(const RecordingReader& recording, const MapSnapshot& map,
                                          const PoseAtTime& T_map_camera, const SupportSurfaces& supports,
                                          const ObjectOptions& options) {
  std::map<int, Landmark> landmarks;
  for (const SnapshotObject& object : map.objects) {
    if (!object.fit.covariance.isZero()) {
      landmarks.emplace(object.id, LandmarkOf(object, supports));
    }
  }
  std::int64_t last_frame = -1;
  for (int i = 0; i < recording.Size(); ++i) {
    const MapSnapshotPtr snapshot = recording.Read(i);
    if (snapshot->frame_index <= last_frame) {
      continue;
    }
    last_frame = snapshot->frame_index;
    if (const std::optional<Rigid3d> pose = T_map_camera(snapshot->timestamp)) {
      AddViews(*snapshot, *pose, options, landmarks);
    }
  }
  for (auto& [id, landmark] : landmarks) {
    SetPoints(map, landmark, [&](std::size_t i) { return map.points[i].object_id == landmark.id; });
  }
  return landmarks;
}

}  // namespace sqslam
