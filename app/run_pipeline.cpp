#include "app/run_pipeline.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <mutex>
#include <optional>

#include "app/attempt_all.h"
#include "app/interrupt.h"
#include "app/map_files.h"
#include "app/pace.h"
#include "app/progress.h"
#include "app/report.h"
#include "app/run_pictures.h"
#include "slam/io/atomic_file.h"
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
  if (request.sequence.camera.empty()) {
    throw UsageError(
        fmt::format("{}: a live camera needs its calibration, expected --camera FILE.yaml or one of {}",
                    *request.live_camera, fmt::join(CameraPresetNames(), ", ")));
  }
  if (!request.sequence.detections.empty()) {
    throw UsageError("--detections: boxes of a recording, expected none with a live camera");
  }
  Sequence sequence;
  sequence.path = fmt::format("camera {}", *request.live_camera);
  sequence.camera = ReadCamera(CameraFile(request.sequence.camera));
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
  if (!sequence.has_detections) {
    spdlog::warn("{}: no boxes.txt and no --detections, so the map will hold no objects",
                 sequence.path.string());
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

struct Played {
  int dropped = 0;       // frames that came too fast
  bool stopped = false;  // by the watch
};

// Plays the frames into the system until they end, Ctrl-C, the watch says so, or a failed recorder.
Played Play(const RunRequest& request, const Sequence& sequence, const Recorder& recorder,
            const InterruptGuard& interrupt, FrameStream& source, System& system) {
  Progress progress(request.live_camera ? 0 : request.range.SizeIn(sequence), request.quiet);
  Pace pace(SteadyPaceClock([&] { return interrupt.Interrupted(); }));
  const bool paced = request.realtime && !request.live_camera;  // a live camera keeps its own time
  Played played;
  if (request.watch.started) {
    request.watch.started(request.live_camera ? 0 : request.range.SizeIn(sequence));
  }
  while (!interrupt.Interrupted() && !recorder.Failed()) {
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
    const TrackingState state = system.Process(*frame);
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
  const std::unique_ptr<FrameStream> source = OpenStream(request, sequence);
  CreateResultFolder(request.output);

  const Clock::time_point start = Clock::now();
  const InterruptGuard interrupt;
  Recorder recorder(request.output / "map.sqmap",
                    {sequence.path.string(), SQSLAM_VERSION, DumpOptions(request.options)});
  System system(sequence.camera, request.options, [&](const MapSnapshotPtr& snapshot) {
    recorder.Add(snapshot);
    if (request.watch.mapped) {
      request.watch.mapped(snapshot);
    }
  });
  const Played played = Play(request, sequence, recorder, interrupt, *source, system);
  RunResult result = system.Finish();
  WarnOfLeftOut(result);

  const bool interrupted = played.stopped || interrupt.Interrupted();
  RunSummary summary{request.output,
                     MakeStats(result, *source, played.dropped, SecondsSince(start), interrupted),
                     interrupted};
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
  SaveRun(request, sequence, result, interrupt, recorder, summary);
  return summary;
}

}  // namespace sqslam::app
