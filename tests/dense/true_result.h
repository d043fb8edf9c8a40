#pragma once

#include <filesystem>
#include <vector>

#include "slam/io/trajectory.h"
#include "slam/snapshot/recording.h"
#include "tests/app/written_sequence.h"
#include "tests/dense/panel_world.h"

namespace sqslam::testing {

// A pan to the right, six centimetres a frame.
inline std::vector<Rigid3d> Pan(int frames, double step) {
  std::vector<Rigid3d> path;
  for (int i = 0; i < frames; ++i) {
    path.push_back({Eigen::Quaterniond::Identity(), {step * (i - frames / 2), 0.01 * (i % 3), 0.0}});
  }
  return path;
}

// The result folder of a run that found the truth.
class TrueResult {
 public:
  explicit TrueResult(const std::vector<Rigid3d>& path, int keyframe_interval = 2) : sequence_(path) {
    MapSnapshot map;
    map.camera = world_.GetCamera();
    Trajectory trajectory;
    for (std::size_t i = 0; i < path.size(); ++i) {
      const auto index = static_cast<std::int64_t>(i);
      trajectory.push_back({static_cast<double>(index) / 30.0, path[i]});
      if (index % keyframe_interval == 0) {
        map.keyframes.push_back({100 + index, index, trajectory.back().timestamp, path[i]});
      }
    }
    for (int v = 5; v < 240; v += 15) {
      for (int u = 5; u < 320; u += 15) {
        const double z = TrueDepth(world_, map.camera, path[0], u, v);
        map.points.push_back(
            {(path[0] * Eigen::Vector3d(z * map.camera.Unproject({double(u), double(v)}))).cast<float>(),
             {},
             -1});
      }
    }
    WriteTrajectory(Path() / "trajectory.txt", trajectory);
    RecordingWriter recording(Path() / "map.sqmap", {sequence_.Path().string(), "test", ""});
    recording.Add(map);
  }
  std::filesystem::path Path() const { return folder_.Path(); }
  const WrittenSequence& Images() const { return sequence_; }
  const TexturedWorld& World() const { return world_; }

 private:
  const TexturedWorld world_;
  WrittenSequence sequence_;
  TemporaryFolder folder_;
};

}  // namespace sqslam::testing
