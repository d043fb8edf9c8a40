#include "slam/run/map_files.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>

#include <algorithm>
#include <exception>
#include <memory>
#include <string>

#include "slam/dense/dense_cloud.h"
#include "slam/io/result_files.h"
#include "slam/io/trajectory.h"
#include "slam/scene/scene_graph.h"
#include "slam/snapshot/recording.h"
#include "slam/util/atomic_file.h"
#include "slam/util/text_lines.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

// trajectory.txt, keyframes.txt, points.ply and objects.json.
void WriteOneMap(const fs::path& folder, const FinishedMap& map) {
  const MapFrame frame = FrameOf(*map.snapshot);
  AttemptAll({[&] { WriteTrajectory(folder / "trajectory.txt", map.trajectory, 1.0, frame.upright); },
              [&] { WriteTrajectory(folder / "keyframes.txt", map.keyframes, 1.0, frame.upright); },
              [&] { WritePoints(folder / "points.ply", map.snapshot->points, frame); },
              [&] { WriteObjects(folder / "objects.json", map.snapshot->objects, frame); }});
}

void WriteSubmaps(const fs::path& folder, const RunResult& result) {
  auto all = static_cast<double>(result.map.trajectory.size());  // more than this run's if a map is extended
  for (const FinishedMap& other : result.others) {
    all += static_cast<double>(other.trajectory.size());
  }
  all = std::max(all, static_cast<double>(result.frames));
  std::string shares;
  for (std::size_t i = 0; i < result.others.size(); ++i) {
    const fs::path submap_folder = folder / "submaps" / std::to_string(i + 1);
    CreateResultFolder(submap_folder);
    WriteOneMap(submap_folder, result.others[i]);
    const auto frames = static_cast<double>(result.others[i].trajectory.size());
    shares += fmt::format("{}{:.0f}", shares.empty() ? "" : ", ", 100.0 * frames / all);
  }
  if (!result.others.empty()) {
    const std::size_t count = result.others.size();
    spdlog::warn(
        "{:.0f} % of the frames lie in the main map, {} % in {} further one{} that share no place with it: "
        "see {}",
        100.0 * static_cast<double>(result.map.trajectory.size()) / all, shares, count, count == 1 ? "" : "s",
        (folder / "submaps").string());
  }
}

double PeakMemoryMib() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

}  // namespace

void AttemptAll(const std::vector<std::function<void()>>& steps) {
  std::exception_ptr failure;
  for (const auto& step : steps) {
    try {
      step();
    } catch (...) {
      failure = failure ? failure : std::current_exception();
    }
  }
  if (failure) {
    std::rethrow_exception(failure);
  }
}

RunStats StatsOf(const RunResult& result) {
  RunStats stats;
  stats.frames = result.frames;
  stats.tracked = result.tracked;
  stats.keyframes = static_cast<int>(result.map.keyframes.size());
  if (result.map.snapshot) {
    stats.points = static_cast<int>(result.map.snapshot->points.size());
    const std::vector<SnapshotObject>& objects = result.map.snapshot->objects;
    stats.objects = static_cast<int>(objects.size());
    stats.uncertain = stats.objects - static_cast<int>(std::ranges::count_if(objects, IsReliable));
  }
  stats.classes = result.map.account;
  for (const FinishedMap& other : result.others) {
    Add(other.account, stats.classes);
  }
  stats.counters = result.counters;
  stats.submaps = static_cast<int>(result.others.size());
  stats.peak_memory_mib = PeakMemoryMib();
  stats.timing_ms = result.timing_ms;
  return stats;
}

void WriteMapFiles(const fs::path& folder, const RunResult& result) {
  AttemptAll({[&] { WriteOneMap(folder, result.map); }, [&] { WriteSubmaps(folder, result); }});
}

void WriteRelations(const fs::path& result) {
  const MapSnapshotPtr map = RecordingReader(result / "map.sqmap").Last();
  WriteSceneGraph(result / "relations.json", SceneGraphOf(*map, result), *map);
}

namespace {

void ScalePoses(double factor, Trajectory& trajectory) {
  for (TimedPose& pose : trajectory) {
    pose.T_map_camera.translation *= factor;
  }
}

// The files name the scale of their lengths (MetresPerUnitIn): a repeated call leaves them as they are.
void RescaleTrajectory(const fs::path& file, double metres, bool upright) {
  const std::string text = ReadFile(file, "a trajectory in TUM format");
  Trajectory trajectory = ReadTrajectory(file);
  ScalePoses(metres / MetresPerUnitIn(text), trajectory);
  WriteTrajectory(file, trajectory, metres, upright);
}

void RescaleCloud(const fs::path& file, double metres) {
  DenseCloud cloud = ReadDensePoints(file);
  const double factor = metres / MetresPerUnitIn(ReadFile(file, "a dense.ply"));
  for (DensePoint& point : cloud) {
    point.p_map *= static_cast<float>(factor);
    point.sigma *= static_cast<float>(factor);
  }
  WriteDenseCloud(file, cloud, metres);
}

}  // namespace

void ScaleResult(const fs::path& result, const std::optional<MapScale>& scale) {
  const fs::path recording = result / "map.sqmap";
  StoreMapScale(recording, scale);
  const MapSnapshotPtr map = RecordingReader(recording).Last();
  const double metres = scale ? scale->metres : 1.0;
  const auto renew = [&](const char* name, const auto& write) {
    return [file = result / name, write] {
      if (fs::exists(file)) {
        write(file);
      }
    };
  };
  const auto rescale_trajectory = [&](const fs::path& file) {
    RescaleTrajectory(file, metres, map->gravity_known);
  };
  AttemptAll(
      {renew("trajectory.txt", rescale_trajectory), renew("keyframes.txt", rescale_trajectory),
       renew("points.ply", [&](const fs::path& file) { WritePoints(file, map->points, FrameOf(*map)); }),
       renew("objects.json", [&](const fs::path& file) { WriteObjects(file, map->objects, FrameOf(*map)); }),
       renew("dense.ply", [&](const fs::path& file) { RescaleCloud(file, metres); }),
       renew("relations.json", [&](const fs::path&) { WriteRelations(result); })});
}

void ScaleRun(const MapScale& scale, FinishedRun& run) {
  ScaleResult(run.output, scale);
  FinishedMap& map = run.result.map;
  MapSnapshot metric = *map.snapshot;
  ScaleLengths(scale.metres, metric);
  metric.metric = true;
  map.snapshot = std::make_shared<MapSnapshot>(std::move(metric));
  ScalePoses(scale.metres, map.trajectory);
  ScalePoses(scale.metres, map.keyframes);
}

}  // namespace sqslam
