#include "slam/run/trial_run.h"

#include "slam/run/frames_ahead.h"
#include "slam/system.h"

namespace sqslam {
TrialRun MapForTrial(const Sequence& sequence, FrameRange range, const TrialProgress& progress) {
  constexpr double kFps = 10.0;
  constexpr std::int64_t kMinFrames = 400;
  range = ThinnedRange(range, range.SizeIn(sequence), sequence.camera.fps, kFps, kMinFrames);
  SystemOptions options;
  options.in_step = true;
  System system(sequence.camera, options, [](const MapSnapshotPtr&) {});
  FrameSource source(sequence, range);
  const std::int64_t total = range.SizeIn(sequence);
  bool stopped = false;
  TrialRun trial;
  FramesAhead frames(source, system, false);
  while (const std::optional<Frame> frame = stopped ? std::nullopt : frames.Next()) {
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
