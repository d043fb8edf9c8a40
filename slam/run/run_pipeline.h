#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "slam/detection/detector.h"
#include "slam/io/frame_source.h"
#include "slam/io/live_source.h"
#include "slam/io/sequence.h"
#include "slam/localizer.h"
#include "slam/run/map_to_extend.h"
#include "slam/run/run_host.h"
#include "slam/run/scale_estimation.h"
#include "slam/system_options.h"

namespace sqslam {
using CameraOpener = std::function<FrameGrabber(int index, const Camera& camera)>;

// Time at which a run makes depth maps: after the map is finished, or while it grows.
enum class DenseTime { kFinal, kLive };
constexpr auto EnumNames(DenseTime) { return std::array{"final", "live"}; }

struct RunRequest {
  SequenceRequest sequence;        // for a live camera only its calibration is used
  std::optional<int> live_camera;  // index of a local camera, instead of a sequence
  CameraOpener open_camera = OpenCamera;
  std::string stream;  // address of live images over the network, instead of a sequence; empty: none
  FrameRange range;
  std::filesystem::path extend;  // a result whose map is extended; empty: a new map
  std::filesystem::path output;  // created; must not exist or be empty
  SystemOptions options;
  std::shared_ptr<ObjectDetector> detector;  // finds the boxes instead of options.detection.network
  std::optional<DenseTime> dense;  // when to make depth maps and a dense cloud (options.dense); empty: never
  std::string command;             // as typed, for the report; empty: unknown
  std::optional<ScaleReference> scale_from;  // reference that scales the map to metres; empty: none
  bool realtime = false;                     // play at the sequence's own speed and drop late frames

  bool IsLive() const { return live_camera || !stream.empty(); }
  bool HasRealClock() const { return realtime || IsLive(); }
};

// The frames of a run, the map that it extends, and the detector.
struct RunInput {
  Sequence sequence;                 // without frames for a live camera
  std::optional<MapToExtend> known;  // empty for a new map
  std::unique_ptr<FrameStream> frames;
  std::shared_ptr<ObjectDetector> detector;  // null if the sequence has boxes or there is no detector
};

// Throws InputError and UsageError for unusable or contradictory requests. Writes nothing.
RunInput OpenInput(const RunRequest& request, const RunHost& host);

// Returns the detection network for a sequence; nothing if the sequence has boxes or there is no network (a
// warning then says how to get one). Throws as LoadNetwork does.
std::optional<NetworkOptions> NetworkFor(const DetectionOptions& options, const Sequence& sequence);

// Returns the timestamp of the frame played after this one; nothing for the last.
std::optional<double> NextTimestamp(const FrameRange& range, const Sequence& sequence, const Frame& frame);

// Maps a sequence or a live camera into a result folder: FrameStream -> System -> Recorder, then the result
// files and, by the host, the pictures. A live camera plays until it ends, the host stops the run, or
// range.count frames. Throws InputError (sequence, disk full), UsageError (options, output folder) and
// NoMapError (with stats.json written); whatever could be written before stays.
FinishedRun RunPipeline(const RunRequest& request, RunHost& host);

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

// Locates the frames of a sequence in a saved map, which stays unchanged. Writes trajectory.txt, stats.json,
// camera.yaml and, for display, a map.sqmap of the map with the poses as its keyframes. Throws InputError and
// UsageError before anything is written, and NoMapError (with stats.json written) if no frame was found.
LocalizedRun LocalizeSequence(const LocalizeRequest& request, RunHost& host);

// Merges two results whose maps share a place (MergeMaps) into a new folder, with the options of the first.
// `dense`: makes a dense cloud of the merged map if one of the two has one, from the images of both. The two
// stay unchanged. Throws InputError, NoMapError and UsageError before anything is written.
FinishedRun MergeResults(const std::filesystem::path& first, const std::filesystem::path& second,
                         const std::filesystem::path& output, RunHost& host, bool dense);

}  // namespace sqslam
