#include "slam/run/dense_step.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstdint>

#include "slam/dense/densify.h"
#include "slam/run/parts_step.h"
#include "slam/snapshot/depth_recording.h"
#include "slam/snapshot/recording.h"
#include "slam/util/error.h"

namespace sqslam {
namespace {

// Copies the depth maps of the keyframes that are still in the map, at their present poses. Returns how many.
int KeepDepth(const std::filesystem::path& known, const FinishedRun& run) {
  const DepthRecording before(known);
  DepthRecording after(run.output / "map.sqmap", DepthRecording::Access::kWrite);
  int kept = 0;
  for (const std::int64_t id : before.Keyframes()) {
    const auto& keyframes = run.result.map.snapshot->keyframes;
    const auto keyframe = std::ranges::find(keyframes, id, &SnapshotKeyframe::id);
    if (keyframe != keyframes.end()) {
      DepthMap estimate = before.Estimate(id), confirmed = before.Kept(id);
      estimate.T_map_camera = confirmed.T_map_camera = keyframe->T_map_camera;
      after.PutEstimate(estimate, before.Settings(id));
      after.PutKept(confirmed);
      ++kept;
    }
  }
  return kept;
}

}  // namespace

void MakeDense(FinishedRun& run, const DenseOptions& options, int live, RunHost& host,
               const std::filesystem::path& known) {
  const bool stopped = run.interrupted;
  if (stopped && live == 0) {
    return;
  }
  if (run.sequence.empty()) {
    const int kept = known.empty() ? 0 : KeepDepth(known, run);
    spdlog::warn("{}: not all of the mapped images exist as files",
                 kept > 0 ? fmt::format("no new depth maps, {} are kept", kept) : "no dense cloud");
    return;
  }
  try {
    const DensifySummary dense = Densify({.result = run.output, .options = options, .estimate = !stopped},
                                         [&](int done, int total, const std::string& state) {
                                           host.ShowProgress(done, total, state);
                                           if (done == total) {
                                             host.EndProgress();
                                           }
                                           return stopped || !host.Stopped();
                                         });
    if (!dense.interrupted) {
      host.Say(dense.Text());
      if (FindParts(run.output) > 0) {
        run.result.map.snapshot = RecordingReader(run.output / "map.sqmap").Last();
      }
      host.Mesh(run);
    }
  } catch (const NoMapError& error) {
    spdlog::warn(error.what());
  }
}

}  // namespace sqslam
