#include <fmt/format.h>

#include <filesystem>
#include <string>

#include "app/commands/commands.h"
#include "app/run/terminal_run.h"
#include "slam/run/run_pipeline.h"
#include "slam/util/atomic_file.h"

namespace sqslam::app {
namespace {

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
  const std::filesystem::path output =
      a.output.empty() ? FreeResultFolder("out", "merged") : std::filesystem::path(a.output);
  TerminalRun host({"", !a.no_render}, a.quiet);
  const FinishedRun run = MergeResults(a.first, a.second, output, host);
  if (!a.quiet) {
    fmt::print("{} frames, {} keyframes, {} points, {} objects in one map\nresult: {}\n", run.stats.tracked,
               run.stats.keyframes, run.stats.points, run.stats.objects, output.string());
  }
}

}  // namespace

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
