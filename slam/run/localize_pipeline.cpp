#include <fmt/format.h>

#include <ranges>

#include "slam/io/cameras.h"
#include "slam/io/result_files.h"
#include "slam/io/trajectory.h"
#include "slam/run/map_to_extend.h"
#include "slam/run/run_pipeline.h"
#include "slam/snapshot/depth_recording.h"
#include "slam/snapshot/recording.h"
#include "slam/util/atomic_file.h"
#include "slam/util/error.h"
#include "slam/util/options.h"
#include "slam/util/stopwatch.h"
#include "slam/util/to_vector.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

// Returns the last state of the old map with the poses as its keyframes.
MapSnapshot SnapshotWithPoses(const MapSnapshot& map,
                              const std::map<std::int64_t, Localization::Pose>& poses) {
  constexpr std::size_t kMaxCameras = 100;  // more would hide the map
  MapSnapshot picture = map;
  picture.sequence_number = 0;
  picture.keyframes.clear();
  picture.covisibility.clear();
  picture.detections.clear();
  picture.progress.reset();
  const std::size_t step = poses.size() / kMaxCameras + 1;
  std::size_t count = 0;
  for (const auto& [index, pose] : poses) {
    if (count++ % step == 0 || count == poses.size()) {
      picture.keyframes.push_back({index, index, pose.timestamp, pose.T_map_camera});
    }
  }
  const auto& [index, last] = *poses.rbegin();
  picture.frame_index = index;
  picture.timestamp = last.timestamp;
  picture.image_path = last.image_path;
  picture.T_map_camera = last.T_map_camera;
  return picture;
}

// Returns true if the host stopped it.
bool LocalizeFrames(Localizer& localizer, FrameSource& frames, std::int64_t total, RunHost& host) {
  std::int64_t done = 0;
  int found = 0;
  while (host.AdmitFrame()) {
    const std::optional<Frame> frame = frames.Next();
    if (!frame) {
      break;
    }
    found += localizer.Process(*frame) == TrackingState::kTracking ? 1 : 0;
    host.ShowProgress(++done, total, fmt::format("{} found", found));
  }
  host.EndProgress();
  return host.Stopped();
}

}  // namespace

LocalizedRun LocalizeSequence(const LocalizeRequest& request, RunHost& host) {
  MapToExtend map = ReadKnownMap(request.map);
  for (const std::string& assignment : request.set) {
    SetOption(assignment, map.options);
  }
  CheckOptions(map.options);
  const Sequence sequence = OpenSequenceFor(map, request.sequence);
  request.range.CheckHasFrames(sequence);
  const RecordingReader recording(map.recording);
  const MapSnapshotPtr last = recording.Last();
  Localizer localizer(map.map, map.recording.string(), map.options);
  CreateResultFolder(request.output);

  const Stopwatch stopwatch;
  FrameSource frames(sequence, request.range);
  LocalizedRun run;
  run.interrupted = LocalizeFrames(localizer, frames, request.range.SizeIn(sequence), host);
  run.result = localizer.Finish();
  run.stats.frames = run.result.frames;
  run.stats.skipped = frames.Skipped();
  run.stats.tracked = static_cast<int>(run.result.poses.size());
  run.stats.points = static_cast<int>(last->points.size());
  run.stats.objects = static_cast<int>(last->objects.size());
  run.stats.counters = run.result.counters;
  run.stats.interrupted = run.interrupted;
  run.stats.wall_seconds = stopwatch.Seconds();
  run.stats.timing_ms = run.result.timing_ms;
  WriteStats(request.output / "stats.json", run.stats);
  if (run.result.poses.empty()) {
    if (!run.interrupted) {
      throw NoMapError("{}: none of its {} frames was found in {}: does it show the same place?",
                       sequence.path.string(), run.stats.frames, map.recording.string());
    }
    return run;
  }
  const std::optional<MapScale>& scale = recording.Info().scale;
  if (scale) {
    for (auto& [index, pose] : run.result.poses) {
      pose.T_map_camera.translation *= scale->metres;
    }
  }
  WriteTrajectory(request.output / "trajectory.txt",
                  ToVector(run.result.poses | std::views::values, [](const TimedPose& pose) { return pose; }),
                  scale ? scale->metres : 1.0, last->gravity_known);
  WriteCamera(request.output / "camera.yaml", InFilePixels(sequence.camera, sequence));
  RecordingInfo info = recording.Info();
  info.sequence_path = sequence.path.string();
  RecordingWriter(request.output / "map.sqmap", info).Add(SnapshotWithPoses(*last, run.result.poses));
  DepthRecording(request.output / "map.sqmap", DepthRecording::Access::kWrite).TakeFinished(map.recording);
  return run;
}

}  // namespace sqslam
