#include <fmt/format.h>

#include "app/commands/commands.h"
#include "app/commands/run_arguments.h"
#include "slam/run/run_pipeline.h"
#include "slam/util/options.h"

namespace sqslam::app {
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
  sqslam run film.mp4 --resize 960               a phone's video: estimates the focal length, detects objects
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

}  // namespace

void AddRunCommand(Command& program) {
  const auto [command, a] = program.AddCommand(
      "run", "Map an image sequence: objects, points, trajectory, pictures", kRunExamples, Run);
  a.AddTo(command);
}

}  // namespace sqslam::app
