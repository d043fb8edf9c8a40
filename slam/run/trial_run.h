#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "slam/io/frame_source.h"
#include "slam/io/sequence.h"

namespace sqslam {

// Outcome of mapping a film for trial.
struct TrialRun {
  int frames = 0;             // that were tried
  int mapped = 0;             // of them, in the main map
  int losses = 0;             // times that tracking was lost
  std::string no_map_reason;  // if no map could be built

  double Share() const { return frames > 0 ? static_cast<double>(mapped) / frames : 0.0; }
};

// Called after each frame; false ends the trial.
using TrialProgress = std::function<bool(std::int64_t done, std::int64_t total)>;

// Maps the frames as a run with the default options does, without boxes and thinned out to about ten a
// second, though not to fewer than 400: several times faster than the film lasts.
TrialRun MapForTrial(const Sequence& sequence, FrameRange range, const TrialProgress& progress);

}  // namespace sqslam
