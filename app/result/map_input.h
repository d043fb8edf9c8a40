#pragma once

#include <filesystem>
#include <string>

#include "app/command_line/command.h"
#include "render/scene/style.h"
#include "slam/geometry/rigid3.h"
#include "slam/io/point_cloud.h"
#include "slam/io/trajectory.h"
#include "slam/snapshot/object_edits.h"
#include "slam/snapshot/recording.h"

namespace sqslam::app {

// Returns the recording for a path given by the user: the file itself, or map.sqmap in a result folder.
std::filesystem::path MapFile(const std::filesystem::path& map);

// Selects the objects of a map that a command works on.
struct ObjectArguments {
  std::string edits;           // file of the viewer's edits, or "auto"; empty: none
  bool reliable_only = false;  // leave out uncertain objects
  std::string chosen{};        // ids and labels of the only objects wanted, with commas; empty: all

  bool Changes() const { return !edits.empty() || reliable_only || !chosen.empty(); }
};

void AddObjectOptions(Command& command, ObjectArguments& arguments);

// Returns the options as words of a command line, with absolute paths.
std::vector<std::string> OptionsOf(const std::filesystem::path& recording, const ObjectArguments& objects);

// Resolves the option to a file: "auto" is the one beside the recording; empty if the option was not given.
// Throws InputError if "auto" finds none.
std::filesystem::path EditsFile(const std::filesystem::path& recording, const std::string& edits);

// Opens a recording whose snapshots are edited and filtered as they are read. Warns about edits of objects
// that the map does not have. Throws InputError that names the file, UsageError if it has no chosen object.
RecordingReader OpenMap(const std::filesystem::path& recording, const ObjectArguments& objects,
                        HiddenObjects hidden);

// Additional layers to draw with a map: options of `sqslam render` and of the viewer.
struct LayerArguments {
  std::string ground_truth;               // a sequence; "auto": the one that was mapped; empty: none
  std::string dense_cloud{};              // a file; empty: the recording's own
  std::string dense_cloud_frame = "map";  // "map", or "world": the frame of the true poses
};

void AddLayerOptions(Command& command, LayerArguments& arguments);

// Reads the layers that the arguments name, by default the recording's own dense cloud, and aligns them to
// the finished map. Skips a cloud that the style does not show. `growing`: also for unfinished maps. Throws
// InputError that names the file, UsageError if "auto" cannot be resolved.
SceneLayers ReadLayers(const LayerArguments& arguments, const RecordingReader& reader,
                       const std::filesystem::path& recording, const SceneStyle& style, bool growing = false);

// Compares a map, aligned by S_world_map, with the true poses of a sequence and, where it has any, its true
// objects, as `sqslam eval` does. Throws InputError if objects_gt.json is broken.
std::shared_ptr<const MapTruth> CompareWithTruth(const MapSnapshot& map, const Trajectory& truth,
                                                 const Sim3d& S_world_map,
                                                 const std::filesystem::path& sequence);

// Returns the mesh of a densified recording, null for any other recording. `growing`: with the frame from
// which each vertex is seen. Throws InputError that names the file if it is broken.
SurfaceMeshPtr ReadMesh(const std::filesystem::path& recording, bool growing);

// Returns the error message for true poses that AlignTruePath cannot align to a map.
std::string TruePathError(const std::filesystem::path& sequence);

// ReadPointCloud, but throws InputError on an empty cloud and warns about points that are not finite.
PointCloud ReadDenseCloud(const std::filesystem::path& file);

// Transforms a cloud into the map frame; `color` is used if it has no colours of its own.
CloudLayerPtr PlaceCloud(const PointCloud& cloud, const Sim3d& S_map_file, const Eigen::Vector3d& color);

}  // namespace sqslam::app
