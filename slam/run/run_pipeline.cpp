#include "slam/run/run_pipeline.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>

#include <chrono>
#include <functional>
#include <optional>

#include "app/report/report.h"
#include "slam/run/attempt_all.h"
#include "slam/run/auto_camera.h"
#include "slam/run/detection_feed.h"
#include "app/terminal/interrupt.h"
#include "slam/run/map_files.h"
#include "slam/run/pace.h"
#include "app/terminal/progress.h"
#include "app/run/run_pictures.h"
#include "slam/run/run_recorder.h"
#include "slam/io/camera_guess.h"
#include "slam/io/camera_presets.h"
#include "slam/io/camera_yaml.h"
#include "slam/io/trajectory.h"
#include "slam/snapshot/recording.h"
#include "slam/system.h"
#include "slam/util/atomic_file.h"
#include "slam/util/error.h"
#include "slam/util/options.h"

namespace sqslam::app {
namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
namespace {

double SecondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

double PeakMemoryMib() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

RunStats MakeStats(const RunResult& result, const FrameStream& source, int dropped, double wall_seconds,
                   bool interrupted) {
  RunStats stats;
  stats.frames = result.frames;
  stats.skipped = source.Skipped();
  stats.dropped = dropped;
  stats.tracked = result.tracked;
  stats.keyframes = static_cast<int>(result.map.keyframes.size());
  if (result.map.snapshot) {
    stats.points = static_cast<int>(result.map.snapshot->points.size());
    stats.objects = static_cast<int>(result.map.snapshot->objects.size());
  }
  stats.resets = result.resets;
  stats.losses = result.losses;
  stats.relocalizations = result.relocalizations;
  stats.loops = result.loops;
  stats.returns = result.returns;
  stats.merges = result.merges;
  stats.submaps = static_cast<int>(result.others.size());
  stats.interrupted = interrupted;
  stats.wall_seconds = wall_seconds;
  stats.peak_memory_mib = PeakMemoryMib();
  stats.timing_ms = result.timing_ms;
  return stats;
}

void WarnOfLeftOut(const RunResult& result) {
  int left_out = result.map.left_out;
  for (const FinishedMap& map : result.others) {
    left_out += map.left_out;
  }
  if (left_out > 0) {
    spdlog::warn("{} objects are left out: their boxes do not determine a quadric that is an ellipsoid",
                 left_out);
  }
}

// A live camera as a sequence whose frames nobody knows yet.
Sequence LiveSequence(const RunRequest& request) {
  if (!request.sequence.detections.empty()) {
    throw UsageError("--detections: boxes of a recording, expected none with a live camera");
  }
  Sequence sequence;
  sequence.path = fmt::format("camera {}", *request.live_camera);
  if (request.sequence.camera.empty() || request.sequence.camera == kAutoCamera) {
    constexpr int kWidth = 640;  // what every camera can give
    constexpr int kHeight = 480;
    const CameraGuess guess = GuessCamera(kWidth, kHeight, Camera().fps);
    sequence.camera = guess.camera;
    sequence.guessed_by = guess.source;
  } else {
    sequence.camera = ReadCamera(CameraFile(request.sequence.camera));
  }
  return sequence;
}

void CheckRequest(const RunRequest& request, const Sequence& sequence) {
  const bool real_clock = request.realtime || request.live_camera;
  if (real_clock && request.options.deterministic) {
    throw UsageError(
        "--deterministic: which frames are dropped differs from run to run, expected no --realtime and no "
        "live "
        "camera");
  }
  if (request.options.mapping.camera.what == "focal+radial") {
    throw UsageError(
        "mapping.camera.what=focal+radial: keypoints of a run stay undistorted as the camera given says, "
        "expected none or focal; --camera auto learns both before the run");
  }
  if (request.live_camera) {
    return;
  }
  if (request.range.SizeIn(sequence) <= 0) {
    throw UsageError(
        fmt::format("--start {} --frames {}: nothing left, expected a part of the sequence's {} frames",
                    request.range.start, request.range.count, sequence.frames.size()));
  }
}

bool Stopped(const RunRequest& request, const InterruptGuard& interrupt) {
  return interrupt.Interrupted() || (request.watch.stopped && request.watch.stopped());
}

std::unique_ptr<FrameStream> OpenStream(const RunRequest& request, const Sequence& sequence,
                                        const InterruptGuard& interrupt) {
  if (request.live_camera) {
    return std::make_unique<LiveSource>(request.open_camera(*request.live_camera, sequence.camera),
                                        sequence.camera, sequence.path.string(), request.range, LiveClock(),
                                        [&] { return Stopped(request, interrupt); });
  }
  return std::make_unique<FrameSource>(sequence, request.range);
}

// When the frame that is played after this one was taken; empty for the last.
std::optional<double> NextTimestamp(const RunRequest& request, const Sequence& sequence, const Frame& frame) {
  const std::int64_t next = frame.index + request.range.stride;
  const std::int64_t end = request.range.start + request.range.SizeIn(sequence) * request.range.stride;
  const bool there = next < std::min(end, static_cast<std::int64_t>(sequence.frames.size()));
  return there ? std::optional(sequence.frames[static_cast<std::size_t>(next)].timestamp) : std::nullopt;
}

// Mean time between the frames that are played, seconds. Lists of images need not say how many there are a
// second.
double FrameInterval(const FrameRange& range, const Sequence& sequence) {
  const std::vector<SequenceFrame>& frames = sequence.frames;
  const double interval = frames.size() < 2 ? 1.0 / sequence.camera.fps
                                            : (frames.back().timestamp - frames.front().timestamp) /
                                                  static_cast<double>(frames.size() - 1);
  return interval * static_cast<double>(range.stride);
}

// What finds the boxes, where they do not come with the sequence.
std::unique_ptr<DetectionFeed> MakeFeed(const RunRequest& request, const Sequence& sequence,
                                        const std::optional<NetworkOptions>& network,
                                        std::optional<Detector> detector) {
  if (!detector) {
    return nullptr;
  }
  if (!request.quiet) {
    spdlog::info("boxes by {}", fs::path(network->file).filename().string());
  }
  const bool real_clock = request.realtime || request.live_camera;
  return std::make_unique<DetectionFeed>(
      std::move(*detector),
      DetectionFeed::Options{request.options.detection, request.options.deterministic,
                             real_clock ? 0.0 : FrameInterval(request.range, sequence),
                             request.output / "boxes.txt",
                             fmt::format("boxes of {}, {}", sequence.path.string(), Fingerprint(*network)),
                             FilePixels(sequence)});
}

struct Played {
  int dropped = 0;       // frames that came too fast
  bool stopped = false;  // by the watch
};

// Plays the frames into the system until they end, Ctrl-C, the watch says so, or a failed recorder.
Played Play(const RunRequest& request, const Sequence& sequence, const Recorder& recorder,
            const InterruptGuard& interrupt, FrameStream& source, DetectionFeed* feed, System& system) {
  Progress progress(request.live_camera ? 0 : request.range.SizeIn(sequence), request.quiet);
  Pace pace(SteadyPaceClock([&] { return interrupt.Interrupted(); }));
  const bool paced = request.realtime && !request.live_camera;  // a live camera keeps its own time
  Played played;
  if (request.watch.started) {
    request.watch.started(request.live_camera ? 0 : request.range.SizeIn(sequence));
  }
  while (!interrupt.Interrupted() && !recorder.Failed() && !(feed != nullptr && feed->Failed())) {
    if (request.watch.go_on && !request.watch.go_on()) {
      played.stopped = true;
      break;
    }
    const std::optional<Frame> frame = source.Next();
    if (!frame) {
      break;
    }
    if (paced && !pace.Admit(frame->timestamp, NextTimestamp(request, sequence, *frame))) {
      continue;
    }
    const TrackingState state = feed != nullptr ? feed->Process(*frame, system) : system.Process(*frame);
    if (request.watch.tracked) {
      request.watch.tracked(*frame, state, system);
    }
    const std::string text = state == TrackingState::kTracking ? recorder.State()
                             : state == TrackingState::kLost   ? "lost"
                                                               : "waiting for motion";
    progress.Update((frame->index - request.range.start) / request.range.stride + 1, text);
  }
  progress.Finish();
  played.dropped = pace.Dropped() + source.Dropped();
  return played;
}

// Makes the video of a run that was not interrupted; Ctrl-C ends it where it is.
void Film(const RunRequest& request, const InterruptGuard& interrupt, RunSummary& summary) {
  if (request.video.empty()) {
    return;
  }
  if (summary.interrupted) {
    spdlog::warn("no video of an interrupted run; sqslam render {} --growth --output {} makes it",
                 request.output.string(), request.video.string());
    return;
  }
  std::optional<Progress> progress;
  DrawGrowth(request.output / "map.sqmap", request.video, [&](int done, int total) {
    if (!progress) {
      progress.emplace(total, request.quiet);
    }
    progress->Update(done, "of the video");
    return !interrupt.Interrupted();
  });
  if (progress) {
    progress->Finish();
  }
  summary.interrupted = interrupt.Interrupted();
  summary.filmed = true;
}

// All files of a run that has a map.
void SaveRun(const RunRequest& request, const Sequence& sequence, const RunResult& result,
             const InterruptGuard& interrupt, Recorder& recorder, RunSummary& summary) {
  const auto draw = [&] {
    if (request.render) {
      StageTimes times;
      if (request.watch.draw) {
        request.watch.draw(*result.map.snapshot, request.output, times);
      } else {
        DrawRun(*result.map.snapshot, request.output, times);
      }
      summary.stats.timing_ms.merge(times.Summaries());
    }
  };
  const auto film = [&] { Film(request, interrupt, summary); };
  const auto report = [&] {
    if (request.render) {
      const bool filmed = summary.filmed;
      WriteReport({request.output, "", sequence.path.string(), filmed ? request.video : fs::path()});
    }
  };
  AttemptAll({[&] { WriteMapFiles(request.output, result.map); },
              [&] { WriteSubmaps(request.output, result.others); }, [&] { recorder.Close(); }, draw, film,
              [&] { WriteStats(request.output / "stats.json", summary.stats); }, report});
}

void SaveRunWithoutMap(const RunRequest& request, Recorder& recorder, const RunSummary& summary) {
  const fs::path recording = request.output / "map.sqmap";
  AttemptAll({[&] { recorder.Close(); },
              [&] { fs::remove(recording); },  // nothing is in it, and nobody should take it for a map
              [&] { WriteStats(request.output / "stats.json", summary.stats); }});
}

[[noreturn]] void RefuseMap(const Sequence& sequence, const FrameStream& source, const RunResult& result) {
  if (result.frames == 0) {
    throw InputError(fmt::format("{}: none of the {} images could be used, expected readable images of {}x{}",
                                 sequence.path.string(), source.Skipped(), sequence.camera.width,
                                 sequence.camera.height));
  }
  throw NoMapError(fmt::format("{}: no map: {}", sequence.path.string(), result.no_map_reason));
}

// The sequence's camera or, where nobody has calibrated it, what the beginning of the sequence says of it.
AutoCamera LearnCamera(const RunRequest& request, const Sequence& sequence, const InterruptGuard& interrupt) {
  if (sequence.guessed_by.empty() || request.live_camera) {
    return {sequence.camera, sequence.guessed_by, sequence.camera};
  }
  return EstimateCamera(sequence, request.range, request.options, request.quiet,
                        [&] { return Stopped(request, interrupt); });
}

// A camera that is only guessed is learnt on during the run.
SystemOptions OptionsWith(const AutoCamera& camera, SystemOptions options) {
  if (camera.IsGuessed() && options.mapping.camera.what == "none") {
    options.mapping.camera.what = "focal";  // keypoints are undistorted by the radial coefficient: it stays
  }
  return options;
}

// The whole run knows more than its beginning.
void TakeLearntCamera(const RunResult& result, AutoCamera& camera) {
  if (result.map.learnt_camera) {
    camera.Take(*result.map.learnt_camera);
  }
  if (camera.IsGuessed()) {
    spdlog::log(camera.learnt ? spdlog::level::info : spdlog::level::warn, camera.Text());
  }
}

}  // namespace

RunSummary RunPipeline(const RunRequest& request) {
  CheckOptions(request.options);
  const Sequence sequence = request.live_camera ? LiveSequence(request) : OpenSequence(request.sequence);
  CheckRequest(request, sequence);
  const std::optional<NetworkOptions> network = ChooseNetwork(request.options.detection, sequence);
  const InterruptGuard interrupt;
  const std::unique_ptr<FrameStream> source = OpenStream(request, sequence, interrupt);
  std::optional<Detector> detector;
  if (network) {
    detector.emplace(*network);  // before the folder: a network that cannot be used leaves nothing behind
  }
  CreateResultFolder(request.output);
  const std::unique_ptr<DetectionFeed> feed = MakeFeed(request, sequence, network, std::move(detector));

  const Clock::time_point start = Clock::now();
  AutoCamera camera = LearnCamera(request, sequence, interrupt);
  const SystemOptions options = OptionsWith(camera, request.options);
  Recorder recorder(request.output / "map.sqmap",
                    {sequence.path.string(), SQSLAM_VERSION, DumpOptions(options)});
  System system(camera.camera, options, [&](const MapSnapshotPtr& snapshot) {
    recorder.Add(snapshot);
    if (request.watch.mapped) {
      request.watch.mapped(snapshot);
    }
  });
  const Played played = Play(request, sequence, recorder, interrupt, *source, feed.get(), system);
  if (feed) {
    feed->Finish(system);
  }
  RunResult result = system.Finish();
  TakeLearntCamera(result, camera);
  WarnOfLeftOut(result);

  const bool interrupted = played.stopped || interrupt.Interrupted();
  RunSummary summary{request.output,
                     MakeStats(result, *source, played.dropped, SecondsSince(start), interrupted),
                     interrupted};
  if (feed) {
    summary.stats.timing_ms.merge(feed->Times());
  }
  if (!result.map.snapshot) {
    SaveRunWithoutMap(request, recorder, summary);
    if (feed) {
      feed->ThrowFailure();
    }
    if (!summary.interrupted) {
      RefuseMap(sequence, *source, result);
    }
    return summary;
  }
  const AutoCamera* const automatic = camera.IsGuessed() ? &camera : nullptr;
  AttemptAll({[&] { WriteUsedCamera(request.output, camera.camera, automatic); },
              [&] { SaveRun(request, sequence, result, interrupt, recorder, summary); },
              [&] {
                if (feed) {
                  feed->ThrowFailure();
                }
              }});
  return summary;
}

}  // namespace sqslam::app
