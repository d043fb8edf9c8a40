#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "app/commands/commands.h"
#include "app/export/map_export.h"
#include "slam/fitting/fitting.h"
#include "slam/geometry/angles.h"
#include "slam/io/point_cloud.h"
#include "slam/io/result_files.h"
#include "slam/util/options.h"
#include "slam/util/text_lines.h"
#include "slam/util/throw_if.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

struct FitArguments {
  std::string cloud;
  std::vector<std::string> output;
  std::string clusters;
  bool upright = false;
  bool remove_plane = false;
  std::vector<std::string> set;
};

constexpr const char* kFitNotes = R"(
CLOUD is a PLY file (ascii or binary, with x, y, z) or a text file with x y z on each line. By default the whole
cloud is one object in any orientation. It may show only half of the surface and contain noise and outliers.
Lengths are in the unit of the cloud; roll, pitch and yaw define R = Rz(yaw) Ry(pitch) Rx(roll).

Examples:
  sqslam fit mug.ply                                       print the fit
  sqslam fit mug.ply -o mug.json -o mug.obj                also write parameters and a mesh
  sqslam fit box.xyz --upright                             a box on a table: only yaw is free
  sqslam fit table.ply --remove-plane --clusters auto      all objects on a table
)";

MultiFitOptions MakeOptions(const FitArguments& arguments) {
  MultiFitOptions options;
  SetOptions(arguments.set, options);
  options.fit.upright |= arguments.upright;
  options.remove_plane |= arguments.remove_plane;
  if (arguments.clusters == "auto") {
    options.clusters = 0;
  } else if (!arguments.clusters.empty()) {
    options.clusters = ParseNumber<int>(arguments.clusters).value_or(0);
    ThrowIf<UsageError>(options.clusters < 1, "--clusters {}: expected a number of objects, or auto",
                        arguments.clusters);
  }
  CheckOptions(options);
  return options;
}

void CheckOutputs(const std::vector<std::string>& outputs) {
  for (const fs::path output : outputs) {
    const std::string extension = output.extension().string();
    ThrowIf<UsageError>(extension != ".json" && extension != ".obj" && extension != ".ply",
                        "--output {}: unknown extension, expected .json, .obj or .ply", output.string());
  }
}

std::vector<SnapshotObject> ToObjects(const std::vector<SuperquadricFit>& fits) {
  std::vector<SnapshotObject> objects;
  for (const SuperquadricFit& fit : fits) {
    SnapshotObject object;
    object.id = static_cast<std::int32_t>(objects.size());
    object.label = "object";
    object.score = fit.inlier_share;
    object.observations = 1;
    object.points = static_cast<int>(std::ranges::count(fit.inlier, true));
    object.superquadric = fit.superquadric;
    object.yaw = ToParameters(fit.superquadric)[7];
    objects.push_back(std::move(object));
  }
  return objects;
}

void PrintTable(const std::vector<SuperquadricFit>& fits) {
  fmt::print("{:>3} {:>7} {:>8} {:>9}  {:<30} {:>5} {:>5}  {:<30} {:<22}\n", "id", "points", "inliers", "rms",
             "half size", "e1", "e2", "center", "roll pitch yaw");
  int id = 0;
  for (const SuperquadricFit& fit : fits) {
    const auto& [shape, pose] = fit.superquadric;
    const SuperquadricParameters parameters = ToParameters(fit.superquadric);
    const auto three = [](const Eigen::Vector3d& v) { return fmt::format("{:.4g}", fmt::join(v, " ")); };
    const Eigen::Vector3d angles = parameters.segment<3>(5) * kDegreesPerRadian;
    fmt::print("{:>3} {:>7} {:>6.1f} % {:>9.3g}  {:<30} {:>5.2f} {:>5.2f}  {:<30} {:<22}\n", id++, fit.points,
               100.0 * fit.inlier_share, fit.rms, three(shape.half_size), shape.e1, shape.e2,
               three(pose.translation),
               fmt::format("{:.1f}\u00b0 {:.1f}\u00b0 {:.1f}\u00b0", angles.x(), angles.y(), angles.z()));
  }
}

void Fit(const FitArguments& arguments) {
  CheckOutputs(arguments.output);
  const MultiFitOptions options = MakeOptions(arguments);
  const PointCloud cloud = ReadPointCloud(arguments.cloud);
  if (cloud.skipped > 0) {
    spdlog::warn("{}: {} of {} points are not finite and are left out", arguments.cloud, cloud.skipped,
                 cloud.points.size() + static_cast<std::size_t>(cloud.skipped));
  }
  std::vector<SuperquadricFit> fits;
  try {
    fits = FitSuperquadrics(cloud.points, options);
  } catch (const InputError& e) {
    throw InputError("{}: {}", arguments.cloud, e.what());
  }
  PrintTable(fits);
  const std::vector<SnapshotObject> objects = ToObjects(fits);
  for (const fs::path output : arguments.output) {
    if (output.extension() == ".json") {
      WriteObjects(output, objects);
    } else {
      WriteObjectMeshes(output, objects, {.frame = "frame of the cloud"});
    }
  }
}

std::string FitNotes() {
  std::string notes = kFitNotes + std::string("\nOptions for --set, with their defaults:\n");
  for (const std::string& line : Split(DumpOptions(MultiFitOptions()), '\n')) {
    notes += "| " + line + "\n";
  }
  return notes;
}

}  // namespace

void AddFitCommand(Command& program) {
  const auto [command, a] = program.AddCommand("fit", "Fit superquadrics to a point cloud", FitNotes(), Fit);
  command.Group("Input");
  command.Positional("CLOUD", a.cloud, "Point cloud (.ply, or text with x y z)").Required();
  command.Group("Output");
  command.Option("--output,-o FILE", a.output,
                 ".json objects, .obj or .ply meshes; may be repeated; existing files are replaced");
  command.Group("Fitting");
  command.Flag("--upright", a.upright, "Align the object's z axis with the cloud's: only yaw is free");
  command.Option("--clusters N", a.clusters,
                 "Split the cloud at gaps and fit the N largest parts; default: 1; auto: all of them");
  command.Flag("--remove-plane", a.remove_plane, "First remove the largest plane, such as a table or floor");
  command.Option("--set KEY=VALUE", a.set, "Override one of the options below; may be repeated");
}

}  // namespace sqslam::app
