#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "slam/run/run_watch.h"
#include "slam/io/frame_source.h"
#include "slam/io/live_source.h"
#include "slam/io/result_files.h"
#include "slam/io/sequence.h"
#include "slam/system_options.h"

namespace sqslam::app {

using CameraOpener = std::function<std::unique_ptr<FrameGrabber>(int index, const Camera& camera)>;

struct RunRequest {
  SequenceRequest sequence;        // of a live camera only its calibration counts
  std::optional<int> live_camera;  // index of a camera of this machine, instead of a sequence
  CameraOpener open_camera = OpenCamera;
  FrameRange range;
  std::filesystem::path output;  // folder that is made; must not exist or be empty
  SystemOptions options;
  std::filesystem::path video;  // growth of the map as a video; empty: none
  bool realtime = false;        // play at the sequence's own speed and drop late frames
  bool render = true;           // map.png, figures/ and report.html
  bool quiet = false;           // no progress on stderr
  RunWatch watch;
};

struct RunSummary {
  std::filesystem::path output;
  RunStats stats;
  bool interrupted = false;  // by Ctrl-C or the watch; what had been mapped is saved all the same
  bool filmed = false;       // the video of the growth was made
};

// The main job: sequence or camera -> FrameStream -> System -> result folder, as the contract lists its
// files. A live camera plays until it ends, Ctrl-C or range.count frames. Throws InputError (sequence, disk
// full), UsageError (options, output folder) and NoMapError (with stats.json and map.sqmap written); whatever
// could be written before stays.
RunSummary RunPipeline(const RunRequest& request);

}  // namespace sqslam::app
