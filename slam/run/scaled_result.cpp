#include "slam/run/scaled_result.h"

#include <memory>

#include "slam/dense/dense_cloud.h"
#include "slam/io/result_files.h"
#include "slam/io/trajectory.h"
#include "slam/snapshot/recording.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

void ScalePoses(double factor, Trajectory& trajectory) {
  for (TimedPose& pose : trajectory) {
    pose.T_map_camera.translation *= factor;
  }
}

void ScaleDenseCloud(double factor, const fs::path& file) {
  DenseCloud cloud = ReadDensePoints(file);
  for (DensePoint& point : cloud) {
    point.p_map *= static_cast<float>(factor);
  }
  WriteDenseCloud(file, cloud);
}

}  // namespace

void ScaleResult(const fs::path& result, const std::optional<MapScale>& scale) {
  const fs::path recording = result / "map.sqmap";
  const std::optional<MapScale> before = RecordingReader(recording).Info().scale;
  const double factor = (scale ? scale->metres : 1.0) / (before ? before->metres : 1.0);
  KeepMapScale(recording, scale);
  for (const char* name : {"trajectory.txt", "keyframes.txt"}) {
    if (fs::exists(result / name)) {
      Trajectory trajectory = ReadTrajectory(result / name);
      ScalePoses(factor, trajectory);
      WriteTrajectory(result / name, trajectory);
    }
  }
  const MapSnapshotPtr map = RecordingReader(recording).Last();
  if (fs::exists(result / "points.ply")) {
    WritePoints(result / "points.ply", map->points);
  }
  if (fs::exists(result / "objects.json")) {
    WriteObjects(result / "objects.json", map->objects);
  }
  if (fs::exists(result / "dense.ply")) {
    ScaleDenseCloud(factor, result / "dense.ply");
  }
}

void ScaleRun(const MapScale& scale, FinishedRun& run) {
  ScaleResult(run.output, scale);
  FinishedMap& map = run.result.map;
  auto metric = std::make_shared<MapSnapshot>(*map.snapshot);
  ScaleLengths(scale.metres, *metric);
  metric->metric = true;
  map.snapshot = std::move(metric);
  ScalePoses(scale.metres, map.trajectory);
  ScalePoses(scale.metres, map.keyframes);
}

}  // namespace sqslam
