#include <fmt/format.h>

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "app/cluster/piece_work.h"
#include "app/commands/commands.h"
#include "app/export/map_export.h"
#include "app/terminal/terminal.h"
#include "slam/dense/densify.h"
#include "slam/run/map_files.h"
#include "slam/run/parts_step.h"
#include "slam/system_options.h"
#include "slam/util/data_path.h"
#include "slam/util/options.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

constexpr const char* kDensifyNotes = R"(
Writes dense.ply (a point cloud) and dense.glb (a coloured mesh with holes where nothing was seen) to the result
folder, and depth maps of the keyframes to its map.sqmap. Needs the images that were mapped. Run the same
command to resume after an interruption; other options start over.
With --on slurm, tasks write depth maps to RESULT/dense.sqmap.pieces, and the command fuses them into the same cloud.

Examples:
  sqslam densify out/kitchen
  sqslam densify out/kitchen --images /media/disk/kitchen    if the images have moved
  sqslam densify out/kitchen --set dense.scale=1             full-size images: finer, four times as slow
  sqslam densify out/kitchen --set dense.fusion.min_views=3  fewer, more reliable points
  sqslam densify out/kitchen --on slurm --shards 8           depth maps by the tasks of a cluster
)";

struct DensifyArguments {
  std::string result;
  std::string images;
  std::string config;
  std::vector<std::string> set;
  int threads = 0;
  bool no_mesh = false;
  ClusterArguments cluster;
  bool quiet = false;
};

SystemOptions OptionsOf(const DensifyArguments& a) {
  SystemOptions options;
  if (!a.config.empty()) {
    LoadOptions(a.config, options);
  }
  SetOptions(a.set, options);
  return options;
}

// Densifies the result, with the depth maps of `request.pieces`.
int DensifyHere(const DensifyArguments& a, const DensifyRequest& request) {
  StoppableProgress progress(a.quiet, "keyframe");
  const DensifySummary summary = Densify(request, std::ref(progress));
  const bool meshed =
      !summary.interrupted && !a.no_mesh && WriteSurface(a.result, request.threads, std::ref(progress));
  progress.Finish();
  if (!summary.interrupted) {
    FindParts(a.result);
    WriteRelations(a.result);  // now with walls
  }
  if (progress.interrupt.Interrupted()) {
    PrintNotice(fmt::format("sqslam: stopped after {} depth maps; run the same command to resume",
                            summary.estimated + summary.resumed));
    return 130;
  }
  if (!a.quiet) {
    const fs::path result = a.result;
    fmt::print("{}\nwritten: {}{}\n", summary.Text(), (result / "dense.ply").string(),
               meshed ? ", " + (result / "dense.glb").string() : "");
  }
  return 0;
}

// The pieces are depth maps of some of the keyframes; with them, the result is densified as on one computer.
int DensifyOnSlurm(const DensifyArguments& a, const DensifyRequest& request) {
  const auto with_threads = [&](int cpus) {
    DensifyRequest own = request;
    own.threads = own.threads > 0 ? own.threads : cpus;
    return own;
  };
  const auto make = [&](const Shard& shard, const fs::path& piece, int cpus) {
    StoppableProgress progress(a.quiet, "keyframe");
    return EstimatePiece(with_threads(cpus), shard, piece, std::ref(progress)) ? 0 : 130;
  };
  const auto join = [&](const std::vector<std::string>& pieces, int cpus) {
    DensifyRequest all = with_threads(cpus);
    all.pieces = {pieces.begin(), pieces.end()};
    return DensifyHere(a, all);
  };
  const auto settings = [&] {
    return fmt::format("{} pieces of {}", *a.cluster.shards, DepthFingerprint(request));
  };
  const fs::path result = AbsolutePath(a.result);
  return DoOnSlurm({result.filename(), result / "dense.sqmap", settings, make, join}, a.cluster, a.quiet);
}

int RunDensify(const DensifyArguments& a) {
  a.cluster.Check();
  const DensifyRequest request{a.result, a.images, OptionsOf(a).dense, a.threads};
  return a.cluster.OnSlurm() ? DensifyOnSlurm(a, request) : DensifyHere(a, request);
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
  a.cluster.AddTo(command);
  command.QuietFlag(a.quiet, "No progress and no summary");
}

}  // namespace sqslam::app
