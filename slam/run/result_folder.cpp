#include "slam/run/result_folder.h"

#include <spdlog/spdlog.h>

#include <exception>

#include "slam/io/result_files.h"
#include "slam/io/trajectory.h"
#include "slam/util/atomic_file.h"

namespace sqslam {
namespace fs = std::filesystem;

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

void WriteMapFiles(const fs::path& folder, const FinishedMap& map) {
  AttemptAll({[&] { WriteTrajectory(folder / "trajectory.txt", map.trajectory); },
              [&] { WriteTrajectory(folder / "keyframes.txt", map.keyframes); },
              [&] { WritePoints(folder / "points.ply", map.snapshot->points); },
              [&] { WriteObjects(folder / "objects.json", map.snapshot->objects); }});
}

void WriteSubmaps(const fs::path& folder, const std::vector<FinishedMap>& submaps) {
  std::size_t frames = 0;
  for (std::size_t i = 0; i < submaps.size(); ++i) {
    const fs::path submap_folder = folder / "submaps" / std::to_string(i + 1);
    CreateResultFolder(submap_folder);
    WriteMapFiles(submap_folder, submaps[i]);
    frames += submaps[i].trajectory.size();
  }
  if (!submaps.empty()) {
    spdlog::warn("{} frames lie in {} further map{} that could not be tied to the main one: see {}", frames,
                 submaps.size(), submaps.size() == 1 ? "" : "s", (folder / "submaps").string());
  }
}

}  // namespace sqslam
