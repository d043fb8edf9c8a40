#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>
#include <system_error>

#include "slam/io/cameras.h"
#include "slam/io/fixed_regions.h"
#include "slam/io/live_source.h"
#include "slam/run/run_pipeline.h"
#include "slam/util/throw_if.h"

namespace sqslam {
namespace {

// `images`: of a stream; null for a local camera.
Sequence LiveSequence(const RunRequest& request, const NetworkStream* images) {
  ThrowIf<UsageError>(!request.sequence.detections.empty(),
                      "--detections: applies to recordings only, expected none with a live camera");
  Sequence sequence;
  sequence.path =
      images != nullptr ? PublicAddress(request.stream) : fmt::format("camera {}", *request.live_camera);
  if (request.sequence.camera.empty() || request.sequence.camera == kAutoCamera) {
    const cv::Size size =
        images != nullptr ? images->ImageSize() : cv::Size(640, 480);  // every camera supports it
    const double fps = images != nullptr && images->Fps() > 0.0 ? images->Fps() : Camera().fps;
    const CameraGuess guess = GuessCamera(size.width, size.height, fps);
    sequence.camera = guess.camera;
    sequence.guessed_by = guess.source;
    sequence.guess_deviation = guess.deviation;
  } else {
    sequence.camera = ReadCamera(CameraFile(request.sequence.camera));
  }
  return sequence;
}

void CheckExtension(const RunRequest& request) {
  ThrowIf<UsageError>(request.IsLive(), "--extend: expected a recording instead of a live camera");
  ThrowIf<UsageError>(
      request.dense == DenseTime::kLive,
      "--extend and --dense live: the first images are elsewhere, expected --dense final with --extend");
  std::error_code none;
  ThrowIf<InputError>(std::filesystem::equivalent(request.extend, request.output, none),
                      "--extend {}: cannot be extended into itself, expected another --output",
                      request.extend.string());
}

void CheckRequest(const RunRequest& request, const Sequence& sequence) {
  ThrowIf<UsageError>(request.HasRealClock() && request.options.deterministic,
                      "--deterministic: a real clock drops different frames in each run, expected no "
                      "--realtime and no live camera");
  ThrowIf<UsageError>(request.dense && request.IsLive(),
                      "--dense: reads the images twice, expected a recording instead of a live camera");
  ThrowIf<UsageError>(request.dense == DenseTime::kLive && request.options.deterministic,
                      "--dense live: makes different depth maps in each run, expected "
                      "--dense final with --deterministic");
  ThrowIf<UsageError>(request.options.mapping.camera.what == LearntPart::kFocalAndRadial,
                      "mapping.camera.what=focal+radial: the keypoints of a run are undistorted with the "
                      "given camera, expected none or focal; --camera auto estimates both before the run");
  ThrowIf<UsageError>(!request.IsLive() && request.range.SizeIn(sequence) <= 0,
                      "--start {} --frames {}: nothing left, expected a part of the sequence's {} frames",
                      request.range.start, request.range.count, sequence.frames.size());
}

std::unique_ptr<FrameStream> OpenFrames(const RunRequest& request, const Sequence& sequence,
                                        const RunHost& host, std::shared_ptr<NetworkStream> images) {
  if (!request.IsLive()) {
    return std::make_unique<FrameSource>(sequence, request.range);
  }
  const FrameGrabber grabber = images ? FrameGrabber([images](cv::Mat& bgr) { return images->Read(bgr); })
                                      : request.open_camera(*request.live_camera, sequence.camera);
  return std::make_unique<LiveSource>(grabber, sequence.camera, sequence.path.string(), request.range,
                                      LiveClock(), [&host] { return host.Stopped(); });
}

}  // namespace

RunInput OpenInput(const RunRequest& request, const RunHost& host) {
  RunInput input;
  if (!request.extend.empty()) {
    CheckExtension(request);
    input.known = ReadKnownMap(request.extend);
  }
  std::shared_ptr<NetworkStream> images;
  if (!request.stream.empty()) {
    StreamOptions options;
    options.stopped = [&host] { return host.Stopped(); };
    images = std::make_shared<NetworkStream>(request.stream, options);
  }
  input.sequence = request.IsLive() ? LiveSequence(request, images.get())
                   : input.known    ? OpenSequenceFor(*input.known, request.sequence)
                                    : OpenSequence(request.sequence);
  CheckRequest(request, input.sequence);
  if (!request.IsLive()) {
    input.sequence.fixed_regions = FindFixedRegions(input.sequence);
  }
  input.detector = request.detector;
  const std::optional<NetworkOptions> network =
      input.detector ? std::nullopt : NetworkFor(request.options.detection, input.sequence);
  input.frames = OpenFrames(request, input.sequence, host, std::move(images));
  if (network) {
    input.detector = std::make_shared<Detector>(*network);
  }
  return input;
}

std::optional<NetworkOptions> NetworkFor(const DetectionOptions& options, const Sequence& sequence) {
  if (options.network == "none" || (options.network == "auto" && sequence.has_detections)) {
    return std::nullopt;
  }
  std::optional<NetworkOptions> network = ChooseNetwork(options.network);
  if (!network) {
    spdlog::warn(
        "{}: no boxes and no detector, so the map will hold no objects; scripts/fetch-detector.sh downloads "
        "one",
        sequence.path.string());
  }
  return network;
}

std::optional<double> NextTimestamp(const FrameRange& range, const Sequence& sequence, const Frame& frame) {
  const std::int64_t next = frame.index + range.stride;
  const std::int64_t end = range.start + range.SizeIn(sequence) * range.stride;
  const bool there = next < std::min(end, static_cast<std::int64_t>(sequence.frames.size()));
  return there ? std::optional(sequence.frames[static_cast<std::size_t>(next)].timestamp) : std::nullopt;
}

}  // namespace sqslam
