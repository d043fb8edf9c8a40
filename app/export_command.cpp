#include <fmt/format.h>

#include <memory>
#include <string>

#include "app/commands.h"
#include "app/map_file.h"
#include "app/object_mesh.h"
#include "slam/io/recording.h"
#include "slam/io/result_files.h"
#include "slam/io/trajectory.h"
#include "slam/util/error.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

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
    WriteObjectMeshes(output, map->objects);
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
