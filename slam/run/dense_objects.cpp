#include "slam/run/dense_objects.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <memory>

#include "slam/dense/dense_cloud.h"
#include "slam/geometry/angles.h"
#include "slam/io/result_files.h"
#include "slam/io/trajectory.h"
#include "slam/objects/dense_evidence.h"
#include "slam/objects/recorded_landmarks.h"
#include "slam/snapshot/recording.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

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
  const SupportSurfaces supports = SupportSurfaces::Find(PositionsOf(*map), options.gravity);
  const ClassPriors classes = ClassPriors::Named(options.class_priors);
  EstimationContext context;
  context.options = &options;
  context.camera = map->camera;
  context.upright = true;
  context.supports = &supports;
  context.classes = &classes;
  std::map<int, Landmark> landmarks = RecordedLandmarks(
      recording, *map, PosesByTime(ReadTrajectory(result / "trajectory.txt")), supports, options);
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
