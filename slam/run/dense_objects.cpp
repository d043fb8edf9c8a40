#include "slam/run/dense_objects.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <optional>

#include "slam/dense/dense_cloud.h"
#include "slam/geometry/angles.h"
#include "slam/io/result_files.h"
#include "slam/io/trajectory.h"
#include "slam/objects/dense_evidence.h"
#include "slam/objects/detection_filter.h"
#include "slam/snapshot/recording.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

// Newest pose of the frame at that time.
std::optional<Rigid3d> PoseAt(const Trajectory& trajectory, double timestamp) {
  constexpr double kSame = 1e-4;  // seconds
  const auto it = std::ranges::lower_bound(trajectory, timestamp - kSame, {}, &TimedPose::timestamp);
  return it != trajectory.end() && it->timestamp < timestamp + kSame ? std::optional(it->T_map_camera)
                                                                     : std::nullopt;
}

// The snapshot's boxes, each with what of it shows where its object ends.
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
    BoxView view{snapshot.frame_index, T_map_camera, box.detection.box, {}};
    for (std::size_t edge = 0; edge < 4; ++edge) {
      view.edge_free[edge] = !box.edge_cut[edge] && !box.edge_hidden[edge];
    }
    landmark->second.views.push_back(view);
  }
}

// The landmark's map points, as seen in its boxes.
void AddPoints(const MapSnapshot& map, Landmark& landmark) {
  for (std::size_t i = 0; i < map.points.size(); ++i) {
    if (map.points[i].object_id != landmark.id) {
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

// The landmarks as the recording tells of them; each frame's boxes once.
std::map<int, Landmark> LandmarksOf(const RecordingReader& recording, const MapSnapshot& map,
                                    const Trajectory& trajectory, const SupportSurfaces& supports,
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
    if (const std::optional<Rigid3d> pose = PoseAt(trajectory, snapshot->timestamp)) {
      AddViews(*snapshot, *pose, options, landmarks);
    }
  }
  for (auto& [id, landmark] : landmarks) {
    AddPoints(map, landmark);
  }
  return landmarks;
}

std::vector<SurfacePoint> ReadSurfacePoints(const fs::path& path) {
  std::vector<SurfacePoint> cloud;
  for (const DensePoint& point : ReadDensePoints(path)) {
    if (point.views != kFilledByPlane) {
      cloud.push_back({point.p_map.cast<double>(), point.normal.cast<double>()});
    }
  }
  return cloud;
}

}  // namespace

std::string DenseObjects::Text() const {
  return changed.empty() ? "the dense cloud changes no object"
                         : fmt::format("estimated again with the dense cloud: {}", fmt::join(changed, ", "));
}

DenseObjects RefineObjectsWithCloud(const fs::path& result, const ObjectOptions& options) {
  const RecordingReader recording(result / "map.sqmap");
  const MapSnapshotPtr map = recording.Last();
  DenseObjects outcome;
  if (options.dense_evidence == DenseEvidence::kOff || !map->gravity_known) {
    return outcome;
  }
  std::vector<Eigen::Vector3d> points;
  for (const SnapshotPoint& point : map->points) {
    points.push_back(point.p_map.cast<double>());
  }
  const SupportSurfaces supports = SupportSurfaces::Find(points, options.gravity);
  const ClassPriors classes = ClassPriors::Named(options.class_priors);
  EstimationContext context;
  context.options = &options;
  context.camera = map->camera;
  context.upright = true;
  context.supports = &supports;
  context.classes = &classes;
  std::map<int, Landmark> landmarks =
      LandmarksOf(recording, *map, ReadTrajectory(result / "trajectory.txt"), supports, options);
  const std::vector<int> changed =
      EstimateWithCloud(landmarks, ReadSurfacePoints(result / "dense.ply"), context);
  if (changed.empty()) {
    return outcome;
  }
  auto next = std::make_shared<MapSnapshot>(*map);
  ++next->sequence_number;
  for (SnapshotObject& object : next->objects) {
    if (std::ranges::find(changed, object.id) != changed.end()) {
      const Landmark& landmark = landmarks.at(object.id);
      object.superquadric = landmark.superquadric;
      object.fit = {landmark.box_agreement, PointRms(landmark, landmark.superquadric), landmark.reliability,
                    landmark.covariance};
      object.yaw = YawOf(landmark.superquadric.T_map_object.rotation);
      outcome.changed.push_back(fmt::format("{} {}", object.id, object.label));
    }
  }
  outcome.map = next;
  AppendToRecording(result / "map.sqmap", *next);
  WriteObjects(result / "objects.json", next->objects);
  return outcome;
}

}  // namespace sqslam
