#include "slam/run/trial_run.h"

#include <algorithm>
#include <cmath>

#include "slam/system.h"

namespace sqslam {
namespace {

FrameRange Thinned(FrameRange range, const Sequence& sequence) {
  constexpr double kFps = 10.0;
  constexpr std::int64_t kMinFrames = 400;
  const double fps = sequence.camera.fps > 0.0 ? sequence.camera.fps : 30.0;
  const std::int64_t frames = range.SizeIn(sequence);
  const std::int64_t step =
      std::clamp<std::int64_t>(std::lround(fps / (kFps * static_cast<double>(range.stride))), 1,
                               std::max<std::int64_t>(1, frames / kMinFrames));
  range.stride *= step;
  range.count = (frames + step - 1) / step;
  return range;
}

}  // namespace

TrialRun MapForTrial(const Sequence& sequence, FrameRange range, const TrialProgress& progress) {
  range = Thinned(range, sequence);
  SystemOptions options;
  options.in_step = true;
  System system(sequence.camera, options, [](const MapSnapshotPtr&) {});
  FrameSource source(sequence, range);
  const std::int64_t total = range.SizeIn(sequence);
  bool stopped = false;
  TrialRun trial;
  while (std::optional<Frame> frame = stopped ? std::nullopt : source.Next()) {
    frame->detections.clear();
    system.Process(*frame);
    stopped = progress && !progress(++trial.frames, total);
  }
  const RunResult result =
      system.Finish([&] { return stopped || (progress && !progress(trial.frames, total)); });
  trial.frames = result.frames;
  trial.mapped = result.tracked;
  trial.losses = result.counters.losses;
  trial.no_map_reason = result.no_map_reason;
  return trial;
}

}  // namespace sqslam
