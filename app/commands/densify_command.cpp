#include <fmt/format.h>

#include <string>
#include <vector>

#include "app/commands/commands.h"
#include "app/export/map_export.h"
#include "app/terminal/terminal.h"
#include "slam/dense/densify.h"
#include "slam/run/dense_objects.h"
#include "slam/system_options.h"
#include "slam/util/options.h"

namespace sqslam::app {
namespace {

constexpr const char* kDensifyNotes = R"(
Writes dense.ply (a point cloud) and dense.glb (a coloured mesh with holes where nothing was seen) to the result
folder, and depth maps of the keyframes to its map.sqmap. Needs the images that were mapped. With --set
objects.dense_evidence=auto, objects that the cloud shows better than their boxes are estimated again, in
objects.json and in the recording. Run the same command to resume after an interruption; other options start over.

Examples:
  sqslam densify out/kitchen
  sqslam densify out/kitchen --images /media/disk/kitchen    if the images have moved
  sqslam densify out/kitchen --set dense.scale=1             full-size images: finer, four times as slow
  sqslam densify out/kitchen --set dense.fusion.min_views=3  fewer, more reliable points
)";

struct DensifyArguments {
  std::string result;
  std::string images;
  std::string config;
  std::vector<std::string> set;
  int threads = 0;
  bool no_mesh = false;
  bool quiet = false;
};

int RunDensify(const DensifyArguments& a) {
  SystemOptions options;
  if (!a.config.empty()) {
    LoadOptions(a.config, options);
  }
  SetOptions(a.set, options);
  const InterruptGuard interrupt;
  Progress line(a.quiet, "keyframe");
  const DensifyProgress progress = [&](int done, int total, const std::string& state) {
    line.Update(done, total, state);
    return !interrupt.Interrupted();
  };
  const DensifySummary summary = Densify({a.result, a.images, options.dense, a.threads}, progress);
  const bool meshed = !summary.interrupted && !a.no_mesh && WriteSurface(a.result, a.threads, progress);
  line.Finish();
  if (interrupt.Interrupted()) {
    fmt::print(stderr, "sqslam: stopped after {} depth maps; run the same command to resume\n",
               summary.estimated + summary.resumed);
    return 130;
  }
  const DenseObjects objects = RefineObjectsWithCloud(a.result, options.objects);
  if (!a.quiet && objects.map) {
    fmt::print("{}\n", objects.Text());
  }
  if (!a.quiet) {
    const std::filesystem::path result = a.result;
    fmt::print("{}\nwritten: {}{}\n", summary.Text(), (result / "dense.ply").string(),
               meshed ? ", " + (result / "dense.glb").string() : "");
  }
  return 0;
}

}  // namespace

void AddDensifyCommand(Command& program) {
  const auto [command, a] = program.AddCommand(
      "densify", "Compute depth maps, a dense cloud and a mesh of a finished run", kDensifyNotes, RunDensify);
  command.Group("Input");
  command.Positional("RESULT", a.result, "Result folder of sqslam run").Required();
  command.Option("--images PATH", a.images, "The sequence that was mapped, if it has moved");
  command.Group("Depth");
  command.Option("--config FILE", a.config, "Options (YAML, see `dense` in configs/default.yaml)");
  command.Option("--set KEY=VALUE", a.set,
                 "Override one option, such as dense.stereo.planes=128; may be repeated");
  command.Option("--threads N", a.threads, "Keyframes processed in parallel; 0: one per core").Range(0, 256);
  command.Flag("--no-mesh", a.no_mesh, "Do not write dense.glb");
  command.QuietFlag(a.quiet, "No progress and no summary");
}

}  // namespace sqslam::app
