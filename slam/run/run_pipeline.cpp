#include "slam/run/run_pipeline.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "slam/dense/live_depth.h"
#include "slam/io/cameras.h"
#include "slam/io/trajectory.h"
#include "slam/run/auto_camera.h"
#include "slam/run/dense_step.h"
#include "slam/run/detection_feed.h"
#include "slam/run/frames_ahead.h"
#include "slam/run/map_files.h"
#include "slam/run/map_to_extend.h"
#include "slam/run/pace.h"
#include "slam/run/path_check.h"
#include "slam/run/recorder.h"
#include "slam/run/warning_log.h"
#include "slam/util/atomic_file.h"
#include "slam/util/host.h"
#include "slam/util/options.h"
#include "slam/util/stopwatch.h"
#include "slam/util/throw_if.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

DetectionFeed MakeFeed(const RunRequest& request, const RunInput& input, RunHost& host) {
  if (!input.detector) {
    return {};
  }
  host.Say(fmt::format("boxes by {}", input.detector->Name()));
  return {input.detector,
          {request.options.detection,
           request.HasRealClock() ? DetectionPace::kNewest : DetectionPace::kEveryNth,
           request.output / "boxes.txt",
           input.sequence.path.string(),
           {input.sequence.camera.width, input.sequence.camera.height},
           FileSize(input.sequence)}};
}

// Stores the boxes that came with the sequence, as a detector's are: densify masks moving things by them.
void StoreBoxes(const RunInput& input, const fs::path& output) {
  const Sequence& sequence = input.sequence;
  if (!sequence.has_detections || input.detector) {
    return;
  }
  const cv::Size frame(sequence.camera.width, sequence.camera.height);
  const std::vector<ImageHeader> headers = ImageHeaders(sequence);
  std::vector<std::vector<Detection>> boxes;
  for (std::size_t i = 0; i < sequence.frames.size(); ++i) {
    const int turns = QuarterTurnsTo(frame, headers[i]);
    boxes.push_back(
        InFilePixels(sequence.frames[i].detections, frame, Turned(headers[i].size, turns), turns));
  }
  WriteBoxes(output / "boxes.txt", fmt::format("boxes of {}, as given", sequence.path.string()),
             Timestamps(sequence), boxes);
}

// A camera that is only guessed is refined in the run.
void RefineGuess(const AutoCamera& camera, SystemOptions& options) {
  if (camera.IsGuessed() && options.mapping.camera.what == LearntPart::kNone) {
    // Keypoints are undistorted by the radial coefficient: it stays.
    options.mapping.camera.what = LearntPart::kFocal;
    options.mapping.camera.prior = {camera.guess.fx, camera.guess_deviation};
    // The run may improve the estimate, but not replace it by one that is less certain.
    options.mapping.camera.max_deviation = std::min(options.mapping.camera.max_deviation, camera.deviation);
  }
}

void SayHowImagesAreMapped(const Sequence& sequence, RunHost& host) {
  const cv::Size file = FileSize(sequence);
  const cv::Size frame(sequence.camera.width, sequence.camera.height);
  if (file != frame) {
    host.Say(fmt::format("images of {}x{} are mapped at {}x{} (--resize 1: as they are)", file.width,
                         file.height, frame.width, frame.height));
  }
  if (!sequence.fixed_regions.empty()) {
    const double share = cv::mean(sequence.fixed_regions != 0)[0] / 255.0;
    host.Say(fmt::format("{:.0f} % of the image moves with the camera (a bonnet, a logo): not tracked",
                         std::max(1.0, 100.0 * share)));
  }
  if (sequence.format == SequenceFormat::kImages) {
    const auto turned = std::ranges::count_if(
        ImageHeaders(sequence), [&](const ImageHeader& image) { return QuarterTurnsTo(frame, image) != 0; });
    if (turned > 0) {
      host.Say(fmt::format("{} of {} images were taken with the camera turned and are turned back", turned,
                           sequence.frames.size()));
    }
  }
}

std::unique_ptr<System> MakeSystem(const RunInput& input, const Camera& camera, const SystemOptions& options,
                                   System::SnapshotCallback on_snapshot, System::KeptCallback on_kept) {
  return input.known ? std::make_unique<System>(input.known->map, input.known->recording.string(), options,
                                                std::move(on_snapshot), std::move(on_kept))
                     : std::make_unique<System>(camera, options, std::move(on_snapshot), std::move(on_kept));
}

std::string StateText(TrackingState state, const Recorder& recorder) {
  if (state != TrackingState::kTracking) {
    return state == TrackingState::kLost ? "lost" : "waiting for motion";
  }
  const MapSnapshotPtr map = recorder.Newest();
  return fmt::format("{} keyframes, {} objects", map ? map->keyframes.size() : 0,
                     map ? map->objects.size() : 0);
}

// Plays the frames into the system until they end, the host stops the run, or a disk or the network fails.
// Returns the number of dropped frames. `live` may be null.
int Play(const RunRequest& request, const RunInput& input, const Recorder& recorder, DetectionFeed& feed,
         System& system, LiveDepth* live, RunHost& host) {
  const FrameRange& range = request.range;
  const std::int64_t total = request.IsLive() ? 0 : range.SizeIn(input.sequence);
  const bool paced = request.realtime && !request.IsLive();  // a live camera keeps its own time
  Pace pace(SteadyPaceClock([&host] { return host.Stopped(); }));
  FramesAhead frames(*input.frames, system, true,
                     request.HasRealClock() || input.detector ? 0 : kFramesAhead);
  while (!recorder.Failed() && !feed.Failed() && host.AdmitFrame()) {
    const std::optional<Frame> frame = frames.Next();
    if (!frame) {
      break;
    }
    if (paced && !pace.Admit(frame->timestamp, NextTimestamp(range, input.sequence, *frame))) {
      continue;
    }
    const TrackingState state = feed.Process(*frame, system);
    host.Tracked(*frame, state, system);
    if (live != nullptr && state == TrackingState::kTracking) {
      const FrameView view = system.Newest();
      if (view.T_map_camera) {
        live->Tracked(view.frame_index, *view.T_map_camera);
      }
    }
    host.ShowProgress((frame->index - range.start) / range.stride + 1, total, StateText(state, recorder));
  }
  host.EndProgress();
  return pace.Dropped() + input.frames->Dropped();
}

// The whole run determines the camera better than its beginning.
void AdoptLearntCamera(const RunResult& result, AutoCamera& camera) {
  if (result.map.learnt_camera) {
    camera.Adopt(*result.map.learnt_camera);
  }
  camera.camera.readout_ms = std::round(1e4 * result.readout) / 10.0;
}

// Returns the camera for people and files, in pixels of the images in the files.
AutoCamera CameraInFiles(const AutoCamera& camera, const Sequence& sequence) {
  AutoCamera in_files = camera.InFiles(sequence);
  if (camera.IsGuessed()) {
    spdlog::log(camera.IsVague() ? spdlog::level::warn : spdlog::level::info, in_files.Text());
  }
  return in_files;
}

void WarnAboutOmittedObjects(const RunStats& stats) {
  if (const int left_out = CountLeftOut(stats.classes, LeftOut::kNoQuadric); left_out > 0) {
    spdlog::warn("{} objects are left out: their boxes do not determine a quadric that is an ellipsoid",
                 left_out);
  }
}

void WarnIfFewAreTracked(const RunStats& stats) {
  if (2 * stats.tracked < stats.frames) {
    spdlog::warn(
        "only {} of {} frames are in the map: the camera may turn on the spot, move too fast, or see too "
        "little texture",
        stats.tracked, stats.frames);
  }
}

// Reports what was recovered at the end of the run.
std::string CompletionText(const RunCounters& counters) {
  const auto count = [](int n, const char* what) {
    return fmt::format("{} {}{}", n, what, n == 1 ? "" : "s");
  };
  const std::string frames = counters.placed_at_end > 0
                                 ? fmt::format("{} found a place", count(counters.placed_at_end, "frame"))
                                 : "";
  const std::string maps =
      counters.tied_at_end > 0 ? fmt::format("{} joined another", count(counters.tied_at_end, "map")) : "";
  return fmt::format("at the end {}{}{}", frames, frames.empty() || maps.empty() ? "" : ", ", maps);
}

RunStats MakeStats(const RunResult& result, const RunInput& input, const DetectionFeed& feed) {
  RunStats stats = StatsOf(result);
  stats.skipped = input.frames->Skipped();
  stats.detector_frames = feed.Seen();
  stats.detector = input.detector                  ? input.detector->Name()
                   : input.sequence.has_detections ? "boxes that came with the images"
                                                   : "none";
  stats.timing_ms.merge(feed.Times());
  return stats;
}

// Returns null if no depth maps are wanted during the run, and for videos, whose frames would have to be
// decoded again for each.
std::unique_ptr<LiveDepth> MakeLiveDepth(const RunRequest& request, const RunInput& input) {
  if (request.dense != DenseTime::kLive) {
    return nullptr;
  }
  if (!input.sequence.video_path.empty()) {
    spdlog::warn("--dense live: depth maps of a video are made at the end, expected image files");
    return nullptr;
  }
  return std::make_unique<LiveDepth>(request.output / "map.sqmap", input.sequence, request.options.dense);
}

// Ends live depth and returns the number of depth maps. A failure in the background costs only these.
int FinishLive(std::unique_ptr<LiveDepth> live, RunHost& host) {
  if (!live) {
    return 0;
  }
  try {
    const int made = live->Finish();
    host.Say(fmt::format("{} depth maps during the run", made));
    return made;
  } catch (const InputError& error) {
    spdlog::warn("--dense live: {}", error.what());
    return 0;
  }
}

// Scales the files to metres: by the request's reference, or as the extended map was. If the reference is not
// found, the map stays without scale.
void Scale(const RunRequest& request, const RunInput& input, FinishedRun& run, RunHost& host) {
  std::optional<MapScale> scale;
  if (input.known) {
    scale = ReadMapScale(input.known->recording);
  }
  if (request.scale_from) {
    try {
      scale = EstimateScale(run.output / "map.sqmap", *request.scale_from);
    } catch (const InputError& error) {
      spdlog::warn("--scale-from: {}; set the scale later with sqslam scale", error.what());
    }
  }
  if (scale) {
    ScaleRun(*scale, run);
    host.Say(ScaleText(*scale));
  }
}

void Draw(FinishedRun& run, RunHost& host) {
  StageTimes times;
  host.Draw(run, times);
  run.stats.timing_ms.merge(times.Summaries());
}

// Leaves only stats.json of a run without a map: the recording is empty and must not be taken for a map.
void SaveWithoutMap(const FinishedRun& run, Recorder& recorder) {
  AttemptAll({[&] { recorder.Close(); }, [&] { fs::remove(run.output / "map.sqmap"); },
              [&] { WriteStats(run.output / "stats.json", run.stats); }});
}

[[noreturn]] void ThrowNoMap(const RunRequest& request, const RunInput& input, const RunResult& result) {
  const Sequence& sequence = input.sequence;
  const cv::Size size = FileSize(sequence);
  ThrowIf<InputError>(result.frames == 0,
                      "{}: none of the {} images could be used, expected readable images of {}x{}",
                      sequence.path.string(), input.frames->Skipped(), size.width, size.height);
  const std::string path = sequence.path.string();  // live images cannot be examined again
  ThrowIf<NoMapError>(input.frames->Skipped() >= result.frames,
                      "{}: no map: {} of {} images cannot be used, expected readable images of {}x{}", path,
                      input.frames->Skipped(), input.frames->Skipped() + result.frames, size.width,
                      size.height);
  throw NoMapError("{}: no map: {}{}", path, result.no_map_reason,
                   request.IsLive() ? "" : fmt::format("; sqslam doctor {} looks closer", path));
}

// An extended map needs the images of both parts.
void JoinSequences(const RunInput& input, FinishedRun& run) {
  if (!input.known || !run.result.added) {
    return;
  }
  const fs::path known = RecordingReader(input.known->recording).Info().sequence_path;
  run.sequence = WriteJoinedSequence(run.output, known, input.sequence.path, *run.result.added,
                                     InFilePixels(run.result.kept.camera, input.sequence))
                     .string();
  SetSequencePath(run.output / "map.sqmap", run.sequence);
  WriteJoinedBoxes(run.output, input.known->recording.parent_path(), run.output, *run.result.added);
}

}  // namespace

FinishedRun RunPipeline(const RunRequest& request, RunHost& host) {
  CheckOptions(request.options);
  const WarningLog warnings;
  RunInput input = OpenInput(request, host);  // before the folder: unusable input leaves nothing behind
  CreateResultFolder(request.output);
  SayHowImagesAreMapped(input.sequence, host);
  DetectionFeed feed = MakeFeed(request, input, host);

  const Stopwatch stopwatch;
  SystemOptions options = request.options;
  options.in_step = !request.HasRealClock();  // a recording
  options.database = std::make_shared<FeatureDatabase>();
  AutoCamera camera = LearnCamera(input.sequence, request.range, options, host);
  RefineGuess(camera, options);
  Recorder recorder(request.output / "map.sqmap",
                    {input.sequence.path.string(), SQSLAM_VERSION, DumpOptions(options)});
  std::unique_ptr<LiveDepth> live = MakeLiveDepth(request, input);
  const std::unique_ptr<System> system = MakeSystem(
      input, camera.camera, options,
      [&](const MapSnapshotPtr& map) {
        recorder.Add(map);
        if (live) {
          live->Mapped(map);
        }
        host.Mapped(map);
      },
      [&](SavedMap map) { recorder.Keep(std::move(map)); });
  const int dropped = Play(request, input, recorder, feed, *system, live.get(), host);
  feed.Finish(*system);
  // A run that the host ended is completed too, because live runs always end that way.
  const bool ended = host.Stopped();
  FinishedRun run{request.output,
                  input.sequence.path.string(),
                  system->Finish([&] { return !ended && host.Stopped(); }),
                  {}};
  const int live_depth = FinishLive(std::move(live), host);
  AdoptLearntCamera(run.result, camera);
  const AutoCamera in_files = CameraInFiles(camera, input.sequence);
  run.stats = MakeStats(run.result, input, feed);
  WarnAboutOmittedObjects(run.stats);
  run.stats.dropped = dropped;
  run.stats.interrupted = run.interrupted = host.Stopped();
  run.stats.version = SQSLAM_VERSION;
  run.stats.host = HostName();
  run.stats.job = SlurmJob();
  run.stats.command = request.command;
  run.stats.camera = in_files.IsGuessed() ? in_files.Text() : "calibrated";
  run.stats.wall_seconds = stopwatch.Seconds();
  if (!run.result.map.snapshot) {
    run.stats.warnings = warnings.Lines();
    SaveWithoutMap(run, recorder);
    feed.ThrowFailure();
    if (!run.interrupted) {
      ThrowNoMap(request, input, run.result);
    }
    return run;
  }
  WarnIfFewAreTracked(run.stats);
  for (const std::string& warning : CheckPath(input.sequence, camera.camera, run.result.map)) {
    spdlog::warn(warning);
  }
  if (run.stats.counters.placed_at_end + run.stats.counters.tied_at_end > 0) {
    host.Say(CompletionText(run.stats.counters));
  }
  AttemptAll({[&] { WriteCamera(run.output / "camera.yaml", in_files.camera, in_files.Text()); },
              [&] { WriteMapFiles(run.output, run.result); }, [&] { StoreBoxes(input, run.output); },
              [&] { recorder.Close(); },
              [&] { SaveMapInRecording(run.output / "map.sqmap", run.result.kept); },
              [&] { JoinSequences(input, run); }, [&] { Scale(request, input, run, host); },
              [&] {
                if (request.dense) {
                  MakeDense(run, request.options.dense, live_depth, host,
                            input.known ? input.known->recording : fs::path());
                }
              },
              [&] { WriteRelations(run.output); }, [&] { Draw(run, host); }, [&] { host.Film(run); },
              [&] {
                run.stats.warnings = warnings.Lines();
                WriteStats(run.output / "stats.json", run.stats);
              },
              [&] { host.Report(run); }, [&] { feed.ThrowFailure(); }});
  run.interrupted = host.Stopped();
  return run;
}

}  // namespace sqslam
