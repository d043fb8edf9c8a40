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
#include "slam/snapshot/recording.h"
#include "slam/util/atomic_file.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

// trajectory.txt, keyframes.txt, points.ply and objects.json.
void WriteOneMap(const fs::path& folder, const FinishedMap& map) {
  AttemptAll({[&] { WriteTrajectory(folder / "trajectory.txt", map.trajectory); },
              [&] { WriteTrajectory(folder / "keyframes.txt", map.keyframes); },
              [&] { WritePoints(folder / "points.ply", map.snapshot->points); },
              [&] { WriteObjects(folder / "objects.json", map.snapshot->objects); }});
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
  stats.counters = result.counters;
  stats.submaps = static_cast<int>(result.others.size());
  stats.peak_memory_mib = PeakMemoryMib();
  stats.timing_ms = result.timing_ms;
  return stats;
}

void WriteMapFiles(const fs::path& folder, const RunResult& result) {
  AttemptAll({[&] { WriteOneMap(folder, result.map); }, [&] { WriteSubmaps(folder, result); }});
}

namespace {

void ScalePoses(double factor, Trajectory& trajectory) {
  for (TimedPose& pose : trajectory) {
    pose.T_map_camera.translation *= factor;
  }
}

// Writes one of kScaledFiles in the scale of `map`, see RescaleFile.
void Rescale(const MapSnapshot& map, const fs::path& file, const fs::path& rescaled,
             const std::optional<double>& factor) {
  const std::string name = file.filename().string();
  if (name == "points.ply") {
    WritePoints(rescaled, map.points);
  } else if (name == "objects.json") {
    WriteObjects(rescaled, map.objects);
  } else if (!factor) {
    spdlog::warn("{}: left as it is, since the recording's broken scale does not tell that of this file",
                 file.string());
  } else if (name == "dense.ply") {
    DenseCloud cloud = ReadDensePoints(file);
    for (DensePoint& point : cloud) {
      point.p_map *= static_cast<float>(*factor);
    }
    WriteDenseCloud(rescaled, cloud);
  } else {
    Trajectory trajectory = ReadTrajectory(file);
    ScalePoses(*factor, trajectory);
    WriteTrajectory(rescaled, trajectory);
  }
}

MapSnapshot InMetres(const MapSnapshot& map, const MapScale& scale) {
  MapSnapshot metric = map;
  ScaleLengths(scale.metres, metric);
  metric.metric = true;
  return metric;
}

}  // namespace

void ScaleResult(const fs::path& result, const std::optional<MapScale>& scale) {
  const fs::path recording = result / "map.sqmap";
  const MapSnapshotPtr units = RecordingReader(recording, {}, RecordingReader::Lengths::kInUnits).Last();
  const MapSnapshot map = scale ? InMetres(*units, *scale) : *units;
  KeepMapScale(recording, scale,
               [&map](const fs::path& file, const fs::path& rescaled, const std::optional<double>& factor) {
                 Rescale(map, file, rescaled, factor);
               });
}

void ScaleRun(const MapScale& scale, FinishedRun& run) {
  ScaleResult(run.output, scale);
  FinishedMap& map = run.result.map;
  map.snapshot = std::make_shared<MapSnapshot>(InMetres(*map.snapshot, scale));
  ScalePoses(scale.metres, map.trajectory);
  ScalePoses(scale.metres, map.keyframes);
}

}  // namespace sqslam
