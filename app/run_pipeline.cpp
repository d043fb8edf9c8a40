#include "app/run_pipeline.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <mutex>
#include <optional>

#include "app/attempt_all.h"
#include "app/auto_camera.h"
#include "app/detection_feed.h"
#include "app/interrupt.h"
#include "app/map_files.h"
#include "app/pace.h"
#include "app/progress.h"
#include "app/report.h"
#include "app/run_pictures.h"
#include "slam/io/atomic_file.h"
#include "slam/io/camera_guess.h"
#include "slam/io/camera_presets.h"
#include "slam/io/camera_yaml.h"
#include "slam/io/recording.h"
#include "slam/io/trajectory.h"
#include "slam/system.h"
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

// Takes snapshots from the mapping thread. A disk that fills up must not end that thread: the failure is kept
// for the main thread, which then stops the run and saves the rest.
class Recorder {
 public:
  Recorder(const fs::path& path, const RecordingInfo& info) : writer_(path, info) {}

  void Add(const MapSnapshotPtr& snapshot) {
    if (failed_) {
      return;
    }
    try {
      writer_.Add(*snapshot);
    } catch (const InputError& e) {
      const std::lock_guard lock(mutex_);
      failure_ = e.what();
      failed_ = true;
    }
    keyframes_ = static_cast<int>(snapshot->keyframes.size());
    objects_ = static_cast<int>(snapshot->objects.size());
  }

  void Close() {
    if (!failed_) {
      writer_.Close();
      return;
    }
    const std::lock_guard lock(mutex_);
    throw InputError(failure_);
  }

  bool Failed() const { return failed_; }
  std::string State() const { return fmt::format("{} keyframes, {} objects", keyframes_, objects_); }

 private:
  RecordingWriter writer_;
  std::atomic<bool> failed_ = false;
  std::atomic<int> keyframes_ = 0;
  std::atomic<int> objects_ = 0;
  std::mutex mutex_;
  std::string failure_;  // guarded by mutex_
};

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
  if (request.live_camera) {
    return;
  }
  if (request.range.SizeIn(sequence) <= 0) {
    throw UsageError(
        fmt::format("--start {} --frames {}: nothing left, expected a part of the sequence's {} frames",
                    request.range.start, request.range.count, sequence.frames.size()));
  }
}

std::unique_ptr<FrameStream> OpenStream(const RunRequest& request, const Sequence& sequence) {
  if (request.live_camera) {
    return std::make_unique<LiveSource>(request.open_camera(*request.live_camera, sequence.camera),
                                        sequence.camera, sequence.path.string(), request.range);
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
                             real_clock ? 0.0 : 1.0 / sequence.camera.fps, request.output / "boxes.txt",
                             fmt::format("boxes of {}, {}", sequence.path.string(), Fingerprint(*network)),
                             FilePixels(sequence)});
}

// Plays the frames into the system until they end, Ctrl-C, or a failed recorder. Returns how many were
// dropped.
int Play(const RunRequest& request, const Sequence& sequence, const Recorder& recorder,
         const InterruptGuard& interrupt, FrameStream& source, DetectionFeed* feed, System& system) {
  Progress progress(request.live_camera ? 0 : request.range.SizeIn(sequence), request.quiet);
  Pace pace(SteadyPaceClock([&] { return interrupt.Interrupted(); }));
  const bool paced = request.realtime && !request.live_camera;  // a live camera keeps its own time
  while (!interrupt.Interrupted() && !recorder.Failed()) {
    const std::optional<Frame> frame = source.Next();
    if (!frame) {
      break;
    }
    if (paced && !pace.Admit(frame->timestamp, NextTimestamp(request, sequence, *frame))) {
      continue;
    }
    const TrackingState state = feed != nullptr ? feed->Process(*frame, system) : system.Process(*frame);
    const std::string text = state == TrackingState::kTracking ? recorder.State()
                             : state == TrackingState::kLost   ? "lost"
                                                               : "waiting for motion";
    progress.Update((frame->index - request.range.start) / request.range.stride + 1, text);
  }
  progress.Finish();
  return pace.Dropped() + source.Dropped();
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
}

// All files of a run that has a map.
void SaveRun(const RunRequest& request, const Sequence& sequence, const RunResult& result,
             const InterruptGuard& interrupt, Recorder& recorder, RunSummary& summary) {
  const auto draw = [&] {
    if (request.render) {
      StageTimes times;
      DrawRun(*result.map.snapshot, request.output, times);
      summary.stats.timing_ms.merge(times.Summaries());
    }
  };
  const auto film = [&] { Film(request, interrupt, summary); };
  const auto report = [&] {
    if (request.render) {
      const bool filmed = fs::exists(request.video);
      WriteReport({request.output, "", sequence.path.string(), filmed ? request.video : fs::path()});
    }
  };
  AttemptAll({[&] { WriteMapFiles(request.output, result.map); },
              [&] { WriteSubmaps(request.output, result.others); }, [&] { recorder.Close(); }, draw, film,
              [&] { WriteStats(request.output / "stats.json", summary.stats); }, report});
}

}  // namespace

RunSummary RunPipeline(const RunRequest& request) {
  CheckOptions(request.options);
  const Sequence sequence = request.live_camera ? LiveSequence(request) : OpenSequence(request.sequence);
  CheckRequest(request, sequence);
  const std::optional<NetworkOptions> network = ChooseNetwork(request.options.detection, sequence);
  const std::unique_ptr<FrameStream> source = OpenStream(request, sequence);
  std::optional<Detector> detector;
  if (network) {
    detector.emplace(*network);  // before the folder: a network that cannot be used leaves nothing behind
  }
  CreateResultFolder(request.output);
  const std::unique_ptr<DetectionFeed> feed = MakeFeed(request, sequence, network, std::move(detector));

  const Clock::time_point start = Clock::now();
  const InterruptGuard interrupt;
  AutoCamera camera{sequence.camera, sequence.guessed_by, sequence.camera};
  SystemOptions options = request.options;
  if (!sequence.guessed_by.empty()) {
    if (!request.live_camera) {
      camera = EstimateCamera(sequence, request.range, options, request.quiet,
                              [&] { return interrupt.Interrupted(); });
    }
    // The whole run knows more than its beginning. The radial coefficient stays: keypoints are undistorted by
    // it.
    options.mapping.camera.what = "focal";
  }
  Recorder recorder(request.output / "map.sqmap",
                    {sequence.path.string(), SQSLAM_VERSION, DumpOptions(request.options)});
  System system(camera.camera, options,
                [&recorder](const MapSnapshotPtr& snapshot) { recorder.Add(snapshot); });
  const int dropped = Play(request, sequence, recorder, interrupt, *source, feed.get(), system);
  if (feed) {
    feed->Finish(system);
  }
  RunResult result = system.Finish();
  if (result.map.learnt_camera) {
    camera.Take(*result.map.learnt_camera);
  }
  if (!sequence.guessed_by.empty()) {
    spdlog::log(camera.learnt ? spdlog::level::info : spdlog::level::warn, camera.Text());
  }
  WarnOfLeftOut(result);

  RunSummary summary{request.output,
                     MakeStats(result, *source, dropped, SecondsSince(start), interrupt.Interrupted()),
                     interrupt.Interrupted()};
  if (feed) {
    summary.stats.timing_ms.merge(feed->Times());
  }
  if (!result.map.snapshot) {
    const fs::path recording = request.output / "map.sqmap";
    AttemptAll({[&] { recorder.Close(); },
                [&] { fs::remove(recording); },  // nothing is in it, and nobody should take it for a map
                [&] { WriteStats(request.output / "stats.json", summary.stats); }});
    if (summary.stats.frames == 0 && !summary.interrupted) {
      throw InputError(fmt::format(
          "{}: none of the {} images could be used, expected readable images of {}x{}",
          sequence.path.string(), source->Skipped(), sequence.camera.width, sequence.camera.height));
    }
    if (summary.interrupted) {
      return summary;
    }
    throw NoMapError(fmt::format("{}: no map: {}", sequence.path.string(), result.no_map_reason));
  }
  const AutoCamera* const automatic = sequence.guessed_by.empty() ? nullptr : &camera;
  AttemptAll({[&] { WriteUsedCamera(request.output, camera.camera, automatic); },
              [&] { SaveRun(request, sequence, result, interrupt, recorder, summary); }});
  return summary;
}

}  // namespace sqslam::app
