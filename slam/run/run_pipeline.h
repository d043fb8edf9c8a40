#pragma once

#include "slam/run/run_host.h"
#include "slam/run/run_input.h"

namespace sqslam {

// Maps a sequence or a live camera into a result folder: FrameStream -> System -> Recorder, then the result
// files and, by the host, the pictures. A live camera plays until it ends, the host stops the run, or
// range.count frames. Throws InputError (sequence, disk full), UsageError (options, output folder) and
// NoMapError (with stats.json written); whatever could be written before stays.
FinishedRun RunPipeline(const RunRequest& request, RunHost& host);

}  // namespace sqslam
