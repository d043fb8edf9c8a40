#include <fmt/format.h>

#include <iterator>
#include <memory>
#include <numbers>
#include <string>

#include "app/commands.h"
#include "app/map_file.h"
#include "slam/io/atomic_file.h"
#include "slam/io/recording.h"
#include "slam/io/result_files.h"
#include "slam/io/trajectory.h"
#include "slam/util/error.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

// Wavefront OBJ: one named group of quads for each superquadric (Eq. 1 on a regular grid), with normals.
void WriteObj(const fs::path& path, const MapSnapshot& map) {
  constexpr int kRows = 32;     // steps of eta from pole to pole
  constexpr int kColumns = 64;  // steps of omega around
  std::string text = "# superquadrics, map frame, z up\n";
  auto out = std::back_inserter(text);
  int base = 1;  // OBJ counts from one, over the whole file
  for (const SnapshotObject& object : map.objects) {
    const Rigid3d& pose = object.superquadric.T_map_object;
    fmt::format_to(out, "o {}_{}\n", object.label, object.id);
    for (int row = 0; row <= kRows; ++row) {
      const double eta = std::numbers::pi * (static_cast<double>(row) / kRows - 0.5);
      for (int column = 0; column < kColumns; ++column) {
        const double omega = std::numbers::pi * (2.0 * column / kColumns - 1.0);
        const Eigen::Vector3d p = pose * object.superquadric.shape.PointAt(eta, omega);
        const Eigen::Vector3d n = pose.rotation * object.superquadric.shape.NormalAt(eta, omega);
        fmt::format_to(out, "v {:.6g} {:.6g} {:.6g}\nvn {:.4f} {:.4f} {:.4f}\n", p.x(), p.y(), p.z(), n.x(),
                       n.y(), n.z());
      }
    }
    for (int row = 0; row < kRows; ++row) {
      for (int column = 0; column < kColumns; ++column) {
        const int a = base + row * kColumns + column;
        const int b = base + row * kColumns + (column + 1) % kColumns;
        fmt::format_to(out, "f {0}//{0} {1}//{1} {2}//{2} {3}//{3}\n", a, b, b + kColumns, a + kColumns);
      }
    }
    base += (kRows + 1) * kColumns;
  }
  WriteFileAtomically(path, text);
}

Trajectory KeyframePoses(const MapSnapshot& map) {
  Trajectory trajectory;
  for (const SnapshotKeyframe& keyframe : map.keyframes) {
    trajectory.push_back({keyframe.timestamp, keyframe.T_map_camera});
  }
  return trajectory;
}

void Export(const fs::path& map_path, const fs::path& output) {
  const std::string extension = output.extension().string();
  if (extension == ".glb") {
    throw UsageError(
        fmt::format("--output {}: .glb is not written by this version, expected .ply, .obj, .json or .txt",
                    output.string()));
  }
  if (extension != ".ply" && extension != ".obj" && extension != ".json" && extension != ".txt") {
    throw UsageError(
        fmt::format("--output {}: unknown extension, expected .ply, .obj, .json or .txt", output.string()));
  }
  const RecordingReader reader(map_path);
  if (reader.Size() == 0) {
    throw InputError(fmt::format("{}: holds no snapshot, expected a map", map_path.string()));
  }
  const MapSnapshotPtr map = reader.Last();
  if (extension == ".ply") {
    WritePoints(output, map->points);
  } else if (extension == ".obj") {
    WriteObj(output, *map);
  } else if (extension == ".json") {
    WriteObjects(output, map->objects);
  } else {
    WriteTrajectory(output, KeyframePoses(*map));
  }
}

}  // namespace

void AddExportCommand(CLI::App& app, int&) {
  struct Arguments {
    std::string map;
    std::string output;
  };
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("export", "Write a map's last state for other programs");
  command->footer(
      "\nBy extension: .ply points, .obj superquadrics as meshes, .json objects, .txt keyframe poses (TUM).\n"
      "\nExamples:\n  sqslam export out/kitchen/map.sqmap --output kitchen.obj\n"
      "  sqslam export out/kitchen --output points.ply\n");
  command->add_option("MAP", arguments->map, "map.sqmap, or the result folder that holds it")->required();
  command->add_option("--output", arguments->output, "File to write; an existing one is replaced")
      ->required();
  command->callback([arguments] { Export(MapFile(arguments->map), arguments->output); });
}

}  // namespace sqslam::app
