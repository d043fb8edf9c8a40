#pragma once

#include <array>
#include <functional>
#include <memory>
#include <optional>

#include "slam/detection/detector.h"
#include "slam/io/frame_source.h"
#include "slam/io/live_source.h"
#include "slam/io/sequence.h"
#include "slam/run/known_map.h"
#include "slam/run/run_host.h"
#include "slam/run/scale_estimation.h"
#include "slam/system_options.h"

namespace sqslam {

using CameraOpener = std::function<FrameGrabber(int index, const Camera& camera)>;

// The time at which a run makes depth maps: once the map is finished, or while it grows.
enum class DenseTime { kFinal, kLive };
constexpr auto EnumNames(DenseTime) { return std::array{"final", "live"}; }

struct RunRequest {
  SequenceRequest sequence;        // of a live camera only its calibration counts
  std::optional<int> live_camera;  // index of a camera of this machine, instead of a sequence
  CameraOpener open_camera = OpenCamera;
  std::string stream;  // address of live images over the network, instead of a sequence; empty: none
  FrameRange range;
  std::filesystem::path extend;  // a result whose map is gone on with; empty: a new map
  std::filesystem::path output;  // folder that is made; must not exist or be empty
  SystemOptions options;
  std::shared_ptr<ObjectDetector> detector;  // finds the boxes instead of options.detection.network
  std::optional<DenseTime> dense;  // when to make depth maps and a dense cloud (options.dense); empty: not
  std::string command;             // as it was typed, for the report; empty: not known
  std::optional<ScaleReference> scale_from;  // what the map is brought to metres by; empty: nothing
  bool realtime = false;                     // play at the sequence's own speed and drop late frames

  bool IsLive() const { return live_camera || !stream.empty(); }
  bool HasRealClock() const { return realtime || IsLive(); }
};

// The frames of a run, the map that it goes on with, and the detector for the boxes.
struct RunInput {
  Sequence sequence;              // without frames for a live camera
  std::optional<KnownMap> known;  // empty for a new map
  std::unique_ptr<FrameStream> frames;
  std::shared_ptr<ObjectDetector> detector;  // null where the boxes come with the sequence, or there is none
};

// Throws InputError and UsageError for what cannot be used or makes no sense. Writes nothing.
RunInput OpenInput(const RunRequest& request, const RunHost& host);

// The network that is to find the boxes of a sequence; empty where they come with it, or where there is none
// (a warning then says what would help). Throws as LoadNetwork does.
std::optional<NetworkOptions> NetworkFor(const DetectionOptions& options, const Sequence& sequence);

// Timestamp of the frame that is played after this one; empty for the last.
std::optional<double> NextTimestamp(const FrameRange& range, const Sequence& sequence, const Frame& frame);

}  // namespace sqslam
