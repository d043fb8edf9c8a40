#include <fmt/format.h>

#include <filesystem>
#include <string>
#include <vector>

#include "app/commands/commands.h"
#include "app/commands/run_arguments.h"
#include "app/run/terminal_run.h"
#include "slam/run/run_pipeline.h"
#include "slam/util/atomic_file.h"
#include "slam/util/options.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

constexpr const char* kRunExamples = R"(
Examples:
  sqslam run data/kitchen                        a folder with rgb.txt, camera.yaml and boxes.txt
  sqslam run data/kitchen -o out/k1 --frames 300 --deterministic
  sqslam run photos/ --camera phone.yaml --detections boxes/
  sqslam run living_room_traj2_frei_png          ICL-NUIM, RGB-D Scenes v2 and 7-Scenes as downloaded
  sqslam run rgbd_dataset_freiburg1_xyz --camera tum-freiburg1
  sqslam run --camera-index 0 --camera webcam.yaml   a live camera, until Ctrl-C
  sqslam run rtsp://192.168.1.20/main --camera door.yaml   a network camera
  sqslam run film.mp4                            a phone's video: estimates the focal length, detects objects
  sqslam run film.mp4 --camera phone.yaml --set tracking.features.num_features=1500
  sqslam run data/kitchen --video kitchen.mp4
  sqslam run data/kitchen2 --extend out/kitchen      continue an existing map; the new result holds both
  sqslam run film.mp4 --scale-from cup=0.096         scale in metres: the cup is 9.6 cm high
  sqslam run --dump-config > my.yaml             all options with their defaults
)";

void Print(const FinishedRun& run) {
  const RunStats& stats = run.stats;
  const std::string dropped = stats.dropped > 0 ? fmt::format(" ({} more dropped)", stats.dropped) : "";
  const std::string uncertain = stats.uncertain > 0 ? fmt::format(" ({} uncertain)", stats.uncertain) : "";
  fmt::print("{} of {} frames tracked{}, {} keyframes, {} points, {} objects{} in {:.1f} s\nresult: {}\n",
             stats.tracked, stats.frames, dropped, stats.keyframes, stats.points, stats.objects, uncertain,
             stats.wall_seconds, run.output.string());
  if (stats.detector_frames > 0) {
    fmt::print("detector saw {} of {} frames\n", stats.detector_frames, stats.frames);
  }
  for (const std::string& line : MissingObjectLines(stats.classes)) {
    fmt::print("{}\n", line);
  }
}

int Run(const RunArguments& arguments) {
  if (arguments.dump_config) {
    fmt::print("{}", DumpOptions(arguments.Options()));
    return 0;
  }
  const RunRequest request = arguments.Request();
  TerminalRun host(arguments.Pictures(), arguments.quiet);
  const FinishedRun run = RunPipeline(request, host);
  if (!arguments.quiet) {
    Print(run);
  }
  return run.interrupted ? EndInterrupted(run) : 0;
}

constexpr const char* kLocalizeNotes = R"(
The map does not change; the poses are in its frame and unit. INPUT must be from the camera of the map: this is
assumed if INPUT has no calibration, and a different calibration is refused. The result folder holds trajectory.txt,
camera.yaml, stats.json and a map.sqmap with the map and the new poses, for render and export.

Examples:
  sqslam localize data/kitchen2 --map out/kitchen
  sqslam localize film2.mp4 --map out/film
  sqslam localize photos/ --map out/kitchen -o out/photos
  sqslam render out/photos --output found.png                show where they were taken
)";

struct LocalizeArguments : SequenceArguments {
  std::string map;
  std::string output;
  std::vector<std::string> set;
  bool quiet = false;
};

int RunLocalize(const LocalizeArguments& a) {
  const LocalizeRequest request{
      .sequence = a.Request(),
      .range = a.Range(),
      .map = a.map,
      .output = a.output.empty() ? UnusedResultFolder("out", NameOfInput(a.input)) : fs::path(a.output),
      .set = a.set};
  TerminalRun host({"", false}, a.quiet);
  const LocalizedRun run = LocalizeSequence(request, host);
  PrintSummary(a.quiet, "{} of {} frames found in {:.1f} s\nresult: {}\n", run.stats.tracked,
               run.stats.frames, run.stats.wall_seconds, request.output.string());
  return run.interrupted ? 130 : 0;
}

constexpr const char* kMergeNotes = R"(
Both maps must be from the same camera and overlap. The second is transformed into the frame and scale of the
first, whose objects keep their ids. No images are needed; the two results do not change.

Examples:
  sqslam merge out/kitchen out/kitchen-2 -o out/both
)";

struct MergeArguments {
  std::string first;
  std::string second;
  std::string output;
  bool no_render = false;
  bool quiet = false;
};

void Merge(const MergeArguments& a) {
  const fs::path output = a.output.empty() ? UnusedResultFolder("out", "merged") : fs::path(a.output);
  TerminalRun host({"", !a.no_render}, a.quiet);
  const FinishedRun run = MergeResults(a.first, a.second, output, host, !a.no_render);
  PrintSummary(a.quiet, "{} frames, {} keyframes, {} points, {} objects in one map\nresult: {}\n",
               run.stats.tracked, run.stats.keyframes, run.stats.points, run.stats.objects, output.string());
}

}  // namespace

void AddRunCommand(Command& program) {
  const auto [command, a] = program.AddCommand(
      "run", "Map an image sequence: objects, points, trajectory, pictures", kRunExamples, Run);
  a.AddTo(command);
}

void AddLocalizeCommand(Command& program) {
  const auto [command, a] =
      program.AddCommand("localize", "Find the camera poses of images or a video in a finished map",
                         kLocalizeNotes, RunLocalize);
  a.AddTo(command, "Sequence folder, dataset folder, image folder or video").Required();
  command.Option("--map RESULT", a.map, "Map to localize in: result folder of sqslam run, or its map.sqmap")
      .Required();
  command.Group("Output");
  command.Option("--output,-o DIR", a.output, "Result folder; default: out/NAME, out/NAME-2, ...");
  command.Group("General");
  command.Option("--set KEY=VALUE", a.set,
                 "Override one of the options that the map was made with; may be repeated");
  command.QuietFlag(a.quiet, "Print only warnings and errors");
}

void AddMergeCommand(Command& program) {
  const auto [command, a] =
      program.AddCommand("merge", "Merge two overlapping maps into one", kMergeNotes, Merge);
  command.Group("Input");
  command.Positional("A", a.first, "Result folder of sqslam run, or its map.sqmap").Required();
  command.Positional("B", a.second, "Second result folder, or its map.sqmap").Required();
  command.Group("Output");
  command.Option("--output,-o DIR", a.output, "Result folder; default: out/merged, out/merged-2, ...");
  command.Flag("--no-render", a.no_render, "Do not write pictures and the report");
  command.QuietFlag(a.quiet, "Print only warnings and errors");
}

}  // namespace sqslam::app
