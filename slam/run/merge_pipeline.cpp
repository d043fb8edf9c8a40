#include "slam/io/cameras.h"
#include "slam/run/dense_step.h"
#include "slam/run/map_files.h"
#include "slam/run/map_to_extend.h"
#include "slam/run/run_pipeline.h"
#include "slam/snapshot/depth_recording.h"
#include "slam/snapshot/recording.h"
#include "slam/system_parts.h"
#include "slam/util/atomic_file.h"
#include "slam/util/options.h"
#include "slam/util/stopwatch.h"

namespace sqslam {
namespace fs = std::filesystem;
namespace {

bool HasDepth(const MapToExtend& map) { return !DepthRecording(map.recording).Keyframes().empty(); }

}  // namespace

FinishedRun MergeResults(const fs::path& first, const fs::path& second, const fs::path& output, RunHost& host,
                         bool dense) {
  const Stopwatch stopwatch;
  const MapToExtend a = ReadKnownMap(first);
  const MapToExtend b = ReadKnownMap(second);
  CheckSameCamera(b.recording, b.map.camera, a);
  FinishedRun run{
      output, "", MergeMaps(a.map, a.recording.string(), b.map, b.recording.string(), a.options), {}};
  CreateResultFolder(output);
  run.sequence = WriteJoinedSequence(output, RecordingReader(a.recording).Info().sequence_path,
                                     RecordingReader(b.recording).Info().sequence_path, *run.result.added,
                                     CameraInFiles(a))
                     .string();
  WriteJoinedBoxes(output, a.recording.parent_path(), b.recording.parent_path(), *run.result.added);
  run.stats = StatsOf(run.result);
  run.stats.wall_seconds = stopwatch.Seconds();
  AttemptAll({[&] { WriteCamera(output / "camera.yaml", CameraInFiles(a)); },
              [&] { WriteMapFiles(output, run.result); },
              [&] {
                RecordingWriter(output / "map.sqmap", {run.sequence, SQSLAM_VERSION, DumpOptions(a.options)})
                    .Add(*run.result.map.snapshot);
                SaveMapInRecording(output / "map.sqmap", run.result.kept);
              },
              [&] {
                if (const auto scale = ReadMapScale(a.recording)) {
                  ScaleRun(*scale, run);
                }
              },
              [&] {
                if (dense && (HasDepth(a) || HasDepth(b))) {
                  MakeDense(run, a.options.dense, 0, host, a.recording);
                }
              },
              [&] { WriteRelations(output); },
              [&] {
                StageTimes times;
                host.Draw(run, times);
              },
              [&] { WriteStats(output / "stats.json", run.stats); }, [&] { host.Report(run); }});
  return run;
}

}  // namespace sqslam
