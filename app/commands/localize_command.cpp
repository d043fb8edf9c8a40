#include <fmt/format.h>

#include <filesystem>
#include <string>
#include <vector>

#include "app/commands/commands.h"
#include "app/commands/run_arguments.h"
#include "app/run/terminal_run.h"
#include "slam/run/run_pipeline.h"
#include "slam/util/atomic_file.h"

namespace sqslam::app {
namespace {

constexpr const char* kLocalizeNotes = R"(
The map does not change; the poses are in its frame and unit. INPUT must be from the camera of the map: this is
assumed if INPUT has no calibration, and a different calibration is refused. The result folder holds trajectory.txt,
camera.yaml, stats.json and a map.sqmap with the map and the new poses, for render and export.

Examples:
  sqslam localize data/kitchen2 --map out/kitchen
  sqslam localize film2.mp4 --map out/film --resize 960      if film.mp4 was mapped with --resize 960
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
  const LocalizeRequest request{.sequence = a.Request(),
                                .range = a.Range(),
                                .map = a.map,
                                .output = a.output.empty() ? FreeResultFolder("out", NameOfInput(a.input))
                                                           : std::filesystem::path(a.output),
                                .set = a.set};
  TerminalRun host({"", false}, a.quiet);
  const LocalizedRun run = LocalizeSequence(request, host);
  if (!a.quiet) {
    fmt::print("{} of {} frames found in {:.1f} s\nresult: {}\n", run.stats.tracked, run.stats.frames,
               run.stats.wall_seconds, request.output.string());
  }
  return run.interrupted ? 130 : 0;
}

}  // namespace

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

}  // namespace sqslam::app
