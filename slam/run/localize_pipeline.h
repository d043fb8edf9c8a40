#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "slam/io/frame_source.h"
#include "slam/io/sequence.h"
#include "slam/localizer.h"
#include "slam/run/run_host.h"

namespace sqslam {

struct LocalizeRequest {
  SequenceRequest sequence;
  FrameRange range;
  std::filesystem::path map;     // a result folder or its map.sqmap
  std::filesystem::path output;  // created; must not exist or be empty
  std::vector<std::string> set;  // options that override those of the map, KEY=VALUE
};

struct LocalizedRun {
  Localization result;
  RunStats stats;
  bool interrupted = false;
};

// Locates the frames of a sequence in a kept map, which stays unchanged. Writes trajectory.txt, stats.json,
// camera.yaml and, for display, a map.sqmap of the map with the poses as its keyframes. Throws InputError and
// UsageError before anything is written, and NoMapError (with stats.json written) if no frame was found.
LocalizedRun LocalizeSequence(const LocalizeRequest& request, RunHost& host);

}  // namespace sqslam
