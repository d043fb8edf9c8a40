#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "app/command_line/command.h"
#include "render/scene/style.h"
#include "slam/geometry/rigid3.h"
#include "slam/io/point_cloud.h"
#include "slam/snapshot/object_edits.h"
#include "slam/snapshot/recording.h"

namespace sqslam::app {

// The recording that the user means: the file itself, or map.sqmap in a result folder.
std::filesystem::path MapFile(const std::filesystem::path& map);

// The last part of a path, also of "kitchen/" and ".".
std::string FolderName(const std::filesystem::path& path);

// Which objects of a map a command works on.
struct ObjectArguments {
  std::string edits;           // file of the viewer's edits, or "auto"; empty: as they were mapped
  bool reliable_only = false;  // without the uncertain ones
};

void AddObjectOptions(Command& command, ObjectArguments& arguments);

// The file that the option means: itself, with "auto" the one beside the recording; empty where it was not
// given. Throws InputError where "auto" finds none.
std::filesystem::path EditsFile(const std::filesystem::path& recording, const std::string& edits);

// A recording whose every snapshot is edited and sifted on the way. Warns of edits of objects that the map
// does not have. Throws InputError that names the file.
RecordingReader OpenEdited(const std::filesystem::path& recording, const ObjectArguments& objects,
                           HiddenObjects hidden);

// The same; throws InputError too where no snapshot is in it.
RecordingReader OpenMap(const std::filesystem::path& recording, const ObjectArguments& objects,
                        HiddenObjects hidden);

// Layers that are drawn with a map besides what it holds: options of `sqslam render` and of the viewer.
struct LayerArguments {
  std::string ground_truth;               // a sequence; "auto": the one that was mapped; empty: no true path
  std::string dense_cloud;                // a file; empty: that of the recording
  std::string dense_cloud_frame = "map";  // "map", or "world": that of the true poses
};

void AddLayerOptions(Command& command, LayerArguments& arguments);

// Reads what the arguments name, or else the recording's own dense cloud, and lays it over the finished map;
// no cloud that the style does not show. `growing`: for maps on their way too. Throws InputError that names
// the file, UsageError where "auto" has nothing to mean.
SceneLayers ReadLayers(const LayerArguments& arguments, const RecordingReader& reader,
                       const std::filesystem::path& recording, const SceneStyle& style, bool growing = false);

// The mesh of a densified recording, null of another one; `growing`: with the frames from which its parts are
// seen. Throws InputError that names the file where it is broken.
SurfaceMeshPtr ReadMesh(const std::filesystem::path& recording, bool growing);

// The message for true poses that LayTruePath cannot lay over a map.
std::string CannotBeLaid(const std::filesystem::path& sequence);

// ReadPointCloud, but a cloud without points is an error and points that are none are told.
PointCloud ReadDenseCloud(const std::filesystem::path& file);

// A cloud in the frame of a map; `color` where it has none of its own.
CloudLayerPtr PlaceCloud(const PointCloud& cloud, const Sim3d& S_map_file, const Eigen::Vector3d& color);

}  // namespace sqslam::app
