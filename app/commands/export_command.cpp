#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <functional>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "app/commands/commands.h"
#include "app/commands/render_arguments.h"
#include "app/export/camera_model.h"
#include "app/export/map_export.h"
#include "app/export/map_view.h"
#include "app/export/mjcf.h"
#include "app/export/urdf.h"
#include "app/result/map_input.h"
#include "app/terminal/terminal.h"
#include "slam/io/result_files.h"
#include "slam/io/trajectory.h"
#include "slam/scene/distance_field.h"
#include "slam/scene/scene_graph.h"
#include "slam/snapshot/map_scale.h"
#include "slam/snapshot/recording.h"
#include "slam/util/atomic_file.h"
#include "slam/util/data_path.h"
#include "slam/util/throw_if.h"

namespace sqslam::app {
namespace fs = std::filesystem;
namespace {

struct ExportArguments {
  std::string map;
  std::string output;
  ObjectArguments objects;
  bool meshes = false;
  bool surface = false;
  std::optional<UpAxis> up;
  std::optional<double> scale;
  std::optional<double> cell;
  std::string ground_truth;
  std::optional<ModelFormat> format;
  std::string images;
  bool masks = false;
  bool link = false;
  StyleArguments style;
  bool quiet = false;
};

void CheckArguments(const ExportArguments& a, const std::string& extension) {
  static const std::vector<std::string> kExtensions = {".glb", ".obj",  ".ply",  ".json", ".txt", ".html",
                                                       ".xml", ".urdf", ".usda", ".npy",  ".pgm"};
  ThrowIf<UsageError>(std::ranges::find(kExtensions, extension) == kExtensions.end(),
                      "--output {}: unknown extension, expected {}", a.output, fmt::join(kExtensions, ", "));
  for (const auto& [given, option, only] : {std::tuple(a.meshes, "--meshes", ".ply"),
                                            {a.surface, "--surface", ".glb"},
                                            {a.up.has_value(), "--up", ".obj"},
                                            {!a.ground_truth.empty(), "--ground-truth", ".html"}}) {
    ThrowIf<UsageError>(given && extension != only,
                        "{0}: applies to a {1} only, expected --output FILE{1} instead of {2}", option, only,
                        a.output);
  }
  ThrowIf<UsageError>(a.scale && extension != ".xml" && extension != ".urdf",
                      "--scale: applies to a .xml or .urdf only, expected --output FILE.xml instead of {}",
                      a.output);
  ThrowIf<UsageError>(a.cell && extension != ".npy" && extension != ".pgm",
                      "--cell: applies to a .npy or .pgm only, expected --output FILE.npy instead of {}",
                      a.output);
  const bool colored =
      extension == ".html" || extension == ".glb" || extension == ".usda" || extension == ".obj" || a.meshes;
  ThrowIf<UsageError>(!colored && (!a.style.settings.empty() || a.style.name != StyleArguments().name),
                      "--style and --set: {} holds no colours of classes, expected --output FILE.html, .glb, "
                      ".usda, .obj, or .ply with --meshes",
                      a.output);
}

// Returns the mesh of a densified result; empty if none is wanted.
SurfaceMesh SurfaceToExport(const ExportArguments& a, const fs::path& map_path) {
  Progress progress(a.quiet, "depth map");
  return a.surface ? SurfaceOf(map_path, 0, std::ref(progress)).value() : SurfaceMesh();
}

// Writes the map as an interactive page for a browser.
void WriteViewPage(const ExportArguments& a, const fs::path& map_path) {
  const RecordingReader reader = OpenMap(map_path, a.objects, HiddenObjects::kLeaveOut);
  SceneLayers layers;
  if (!a.ground_truth.empty()) {
    layers = ReadLayers({.ground_truth = a.ground_truth}, reader, map_path, {});
  }
  std::vector<std::string> options = OptionsOf(map_path, a.objects);
  if (!a.ground_truth.empty()) {
    options.push_back("--ground-truth=" +
                      (a.ground_truth == "auto" ? a.ground_truth : AbsolutePath(a.ground_truth).string()));
  }
  if (a.style.name != StyleArguments().name) {
    options.push_back("--style=" + a.style.name);
  }
  for (const std::string& setting : a.style.settings) {
    options.push_back("--set=" + setting);
  }
  WriteFileAtomically(a.output, MapViewPage(reader, map_path,
                                            {.true_path = layers.true_path,
                                             .truth = layers.truth,
                                             .style = a.style.Load(),
                                             .render_options = options}));
}

// Returns the map in metres if its scale is known or given.
MapSnapshot ScaledMap(const ExportArguments& a, const ObjectArguments& objects, const fs::path& map_path) {
  MapSnapshot map = *OpenMap(map_path, objects, HiddenObjects::kLeaveOut).Last();
  if (a.scale) {
    ThrowIf<UsageError>(map.metric, "--scale: {} is in metres already (sqslam scale)", map_path.string());
    ScaleLengths(*a.scale, map);
    map.metric = true;
  }
  return map;
}

// Writes a scene for MuJoCo, of reliable objects only: what is more likely wrong would stand in the way.
void WriteSimulation(const ExportArguments& a, const fs::path& map_path) {
  ObjectArguments objects = a.objects;
  objects.reliable_only = true;
  const MapSnapshot map = ScaledMap(a, objects, map_path);
  const SceneGraph graph = MakeSceneGraph(map, ClassTable::Named("default"));
  const MjcfSummary summary = WriteMjcf(a.output, map, graph);
  for (const std::string& note : summary.notes) {
    spdlog::warn("{}", note);
  }
  PrintSummary(a.quiet, "{} free and {} fixed bodies\nwritten: {}\n", summary.free, summary.fixed, a.output);
}

// Writes distances from the objects on a grid (.npy), or the plan of the cells inside them (.pgm).
void WriteGrid(const ExportArguments& a, const fs::path& map_path, const std::string& extension) {
  constexpr double kCellShare = 0.02;  // of the extent of the objects, by default
  const MapSnapshotPtr map = OpenMap(map_path, a.objects, HiddenObjects::kLeaveOut).Last();
  ThrowIf<InputError>(map->objects.empty(), "{}: the map has no objects", map_path.string());
  Eigen::AlignedBox3d centres;
  double largest = 0.0;
  for (const SnapshotObject& object : map->objects) {
    centres.extend(object.superquadric.T_map_object.translation);
    largest = std::max(largest, object.superquadric.shape.half_size.maxCoeff());
  }
  const double extent = centres.sizes().maxCoeff() + 2.0 * largest;
  const double cell = a.cell.value_or(kCellShare * extent);
  const DistanceGrid grid = SampleDistances(*map, cell, 5.0 * cell, 0.0);
  if (extension == ".npy") {
    WriteDistanceGrid(a.output, grid, *map);
  } else {
    WriteOccupancyPlan(a.output, grid);
  }
  PrintSummary(a.quiet, "{} x {} x {} cells of {:.3g} {}\nwritten: {}\n", grid.size[0], grid.size[1],
               grid.size[2], grid.cell, UnitOf(*map), a.output);
}

// Exports keyframes, points and images for COLMAP or nerfstudio.
void ExportForPrograms(const ExportArguments& a) {
  ThrowIf<UsageError>(
      a.meshes || a.surface || a.objects.reliable_only || !a.objects.edits.empty(),
      "--format {}: holds no objects, expected neither --meshes, --surface, --edits nor --reliable-only",
      NameOf(*a.format));
  Progress progress(a.quiet, "image");
  const ModelSummary summary =
      ExportModel({a.map, a.images, a.output, *a.format, a.masks, a.link}, std::ref(progress));
  PrintSummary(a.quiet, "{} images, {} points, mean reprojection error {:.3f} px\nwritten: {}\n",
               summary.images, summary.points, summary.error, a.output);
  if (summary.of_other_sequence > 0) {
    spdlog::warn("{} keyframes of another sequence are left out (--images)", summary.of_other_sequence);
  }
  if (summary.unreadable > 0) {
    spdlog::warn("keyframes whose images cannot be read, left out: {}", summary.unreadable);
  }
}

void Export(const ExportArguments& a) {
  if (a.format) {
    ExportForPrograms(a);
    return;
  }
  for (const auto& [given, option] :
       {std::pair(!a.images.empty(), "--images"), {a.masks, "--masks"}, {a.link, "--link"}}) {
    ThrowIf<UsageError>(given, "{}: applies to --format only, expected --format colmap or nerfstudio",
                        option);
  }
  const fs::path map_path = MapFile(a.map);
  const fs::path output = a.output;
  const std::string extension = output.extension().string();
  CheckArguments(a, extension);
  CreateFolderOf(output);
  if (extension == ".html") {
    WriteViewPage(a, map_path);
    return;
  }
  if (extension == ".xml") {
    WriteSimulation(a, map_path);
    return;
  }
  if (extension == ".urdf") {
    WriteUrdf(a.output, ScaledMap(a, a.objects, map_path));
    return;
  }
  if (extension == ".npy" || extension == ".pgm") {
    WriteGrid(a, map_path, extension);
    return;
  }
  const RecordingReader reader = OpenMap(map_path, a.objects, HiddenObjects::kKeep);
  const MapSnapshotPtr map = reader.Last();
  if (extension == ".glb") {
    WriteFileAtomically(output,
                        MapGlb(*map, TrackedPoses(map_path, *map), SurfaceToExport(a, map_path),
                               ReadHistory(reader).first_seen, "sqslam " SQSLAM_VERSION, a.style.Load()));
  } else if (extension == ".usda") {
    WriteFileAtomically(output,
                        MapUsd(*map, TrackedPoses(map_path, *map), "sqslam " SQSLAM_VERSION, a.style.Load()));
  } else if (extension == ".obj" || a.meshes) {
    WriteObjectMeshes(
        output, map->objects,
        {LabelColors(a.style.Load().objects.colors), a.up.value_or(UpAxis::kY), FrameOf(*map).Text()});
  } else if (extension == ".ply") {
    WritePoints(output, map->points, FrameOf(*map));
  } else if (extension == ".json") {
    WriteObjects(output, map->objects, FrameOf(*map));
  } else {
    const std::optional<MapScale>& scale = reader.Info().scale;
    WriteTrajectory(output, KeyframeTrajectory(*map), scale ? scale->metres : 1.0, map->gravity_known);
  }
}

constexpr const char* kExportNotes = R"(
By extension:
  .html  interactive 3D page for any browser, one file, no server: objects, points, dense cloud, camera path,
         keyframes with their images, growth of the map
  .glb   everything, for 3D programs (binary glTF 2.0, y up): a node "ID label" for each object, in the colour
         of its class, with half_size, e1, e2, label, id and observations as extras; points; camera path;
         a camera for each keyframe; an animation in which the camera "flight" follows the path and
         objects appear when first seen; with --surface the mesh of sqslam densify
  .usda  objects as meshes with their parameters, points and camera path (text of Universal Scene Description, z up)
  .obj   superquadrics as closed meshes, one named object each, with colours in a .mtl file; y up
  .ply   points (x y z red green blue object_id); with --meshes the superquadrics as one coloured mesh
  .json  objects with all their parameters
  .txt   keyframe poses (TUM)
  .xml   a scene for the simulator MuJoCo (MJCF, metres, gravity down) with meshes in a folder beside it: reliable
         objects as boxes, cylinders, ellipsoids or convex meshes; furniture fixed, small things free; masses and
         friction by class; moved within their covariances so that nothing penetrates; keyframes as cameras
  .urdf  one object (--objects ID) as a robot of one link, in metres, with its convex mesh as .obj beside it; mass and
         friction by class, inertia of an even solid
  .npy   signed distances from the objects on a grid (float32, [z][y][x]), with its frame in a .yaml beside it
  .pgm   floor plan of what the objects occupy, with a .yaml: the format of ROS' map_server
With --format, a new folder with the keyframes of a finished run and their images:
  colmap      sparse/0 with cameras, images and points3D, as .bin and as .txt, including tracks and
              distortion; images/
  nerfstudio  transforms.json, points.ply, images/
With --masks also masks/NAME.png for each image NAME, black outside the objects: both programs ignore what is black.
images/ holds copies of the keyframes' image files (--link: links), with underscores for blanks in their names; frames
of a video, and images that are turned, mirrored or of more than 8 bits, are written as JPEG. All but .glb and .obj use the map frame, z up. With --edits, hidden objects are exported, deleted ones not.
Pages and meshes take the colours of classes (objects.colors) from the style, pages and .glb also cameras.size, .glb
cameras.color.

Examples:
  sqslam export out/kitchen -o kitchen.html
  sqslam export out/kitchen -o kitchen.glb
  sqslam export out/kitchen -o kitchen.glb --surface         after sqslam densify out/kitchen
  sqslam export out/kitchen/map.sqmap -o kitchen.obj
  sqslam export out/kitchen -o kitchen.xml                   after sqslam scale; otherwise with --scale
  sqslam export out/kitchen -o cup.urdf --objects 3
  sqslam export out/kitchen -o points.ply
  sqslam export out/kitchen -o objects.ply --meshes
  sqslam export out/kitchen -o objects.json --edits auto
  sqslam export out/kitchen -o kitchen.html --set objects.colors.cup=#0072b2
  sqslam export out/kitchen -o out/kitchen-colmap --format colmap
  sqslam export out/film -o out/film-nerf --format nerfstudio
)";

}  // namespace

void AddExportCommand(Command& program) {
  const auto [command, a] =
      program.AddCommand("export", "Export a map for other programs", kExportNotes, Export);
  command.Group("Input");
  command.Positional("MAP", a.map, "map.sqmap, or the result folder that holds it").Required();
  AddObjectOptions(command, a.objects);
  command.Group("Output");
  command
      .Option("--output,-o FILE", a.output,
              "FILE.html, .glb, .obj, .ply, .json, .txt, .xml, .urdf, .usda, .npy or .pgm, which is "
              "replaced; with "
              "--format: a new folder")
      .Required();
  command.Option("--format NAME", a.format, "Instead, write a folder with keyframes, tracks and images");
  command.Option("--images PATH", a.images, "With --format: the sequence that was mapped, if it has moved");
  command.Flag("--masks", a.masks, "With --format: also a mask of the objects for each image");
  command.Flag("--link", a.link, "With --format: link the image files instead of copying them");
  command.Flag("--meshes", a.meshes, "In a .ply: superquadrics as meshes instead of points");
  command.Option("--up NAME", a.up,
                 "In a .obj: the axis that points up, y as in .glb or z as in the map (y)");
  command
      .Option("--scale METRES", a.scale,
              "In a .xml or .urdf: length of a map unit, if the map has no scale (sqslam scale)")
      .Range(1e-4, 1e4);
  command
      .Option("--cell LENGTH", a.cell,
              "In a .npy or .pgm: edge of the cells, in metres or map units (2 % of the objects' extent)")
      .Range(1e-6, 1e6);
  command.Flag("--surface", a.surface, "In a .glb: also the coloured mesh of a densified result");
  command.Option("--ground-truth SEQUENCE", a.ground_truth,
                 "In a .html: also the true camera path of this sequence; auto: of the mapped one");
  command.Group("Style");
  a.style.AddTo(command);
  command.QuietFlag(a.quiet, "No progress and no summary");
}

}  // namespace sqslam::app
