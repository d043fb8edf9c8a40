#pragma once

#include <filesystem>
#include <string>

#include "slam/io/frame_source.h"
#include "slam/io/result_files.h"
#include "slam/io/sequence.h"
#include "slam/system_options.h"

namespace sqslam::app {

struct RunRequest {
  SequenceRequest sequence;
  FrameRange range;
  std::filesystem::path output;  // folder that is made; must not exist or be empty
  SystemOptions options;
  std::string representation = "superquadric";  // superquadric | quadric | cuboid: exponents free, 1, or 0.1
  std::filesystem::path video;                  // growth of the map as a video; empty: none
  bool realtime = false;                        // play at the sequence's own speed and drop late frames
  bool render = true;                           // map.png, figures/ and report.html
  bool quiet = false;                           // no progress on stderr
};

struct RunSummary {
  std::filesystem::path output;
  RunStats stats;
  bool interrupted = false;  // by Ctrl-C; what had been mapped is saved all the same
};

// The main job: sequence -> FrameSource -> System -> result folder, as the contract lists its files. Throws
// InputError (sequence, disk full), UsageError (options, output folder) and NoMapError (with stats.json and
// map.sqmap written); whatever could be written before stays.
RunSummary RunPipeline(const RunRequest& request);

}  // namespace sqslam::app
