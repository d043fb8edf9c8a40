#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

#include "app/command_line/command.h"
#include "render/scene/style.h"
#include "slam/geometry/rigid3.h"
#include "slam/io/point_cloud.h"
#include "slam/io/sequence.h"
#include "slam/snapshot/object_edits.h"
#include "slam/snapshot/recording.h"

namespace sqslam::app {

// The recording that the user means: the file itself, or map.sqmap in a result folder.
std::filesystem::path MapFile(const std::filesystem::path& map);

// --edits: edits of the map's objects that the viewer saved. Without it commands show what was mapped.
void AddEditsOption(Command& command, std::string& edits);

// The file that the option means: itself, with "auto" the one beside the recording; empty where it was not
// given. Throws InputError where "auto" finds none.
std::filesystem::path EditsFile(const std::filesystem::path& recording, const std::string& edits);

// A recording whose every snapshot is edited on the way. Warns of edits of objects that the map does not
// have. Throws InputError that names the file.
RecordingReader OpenEdited(const std::filesystem::path& recording, const std::string& edits,
                           HiddenObjects hidden);

// The same; throws InputError too where no snapshot is in it.
RecordingReader OpenMap(const std::filesystem::path& recording, const std::string& edits,
                        HiddenObjects hidden);

// Layers that are drawn with a map besides what it holds: options of `sqslam render` and of the viewer.
struct LayerArguments {
  std::string ground_truth;               // a sequence; "auto": the one that was mapped; empty: no true path
  std::string dense_cloud;                // a file; empty: none
  std::string dense_cloud_frame = "map";  // "map", or "world": that of the true poses
};

void AddLayerOptions(Command& command, LayerArguments& arguments);

// Reads what the arguments name and lays it over the finished map. `sequence`: what was mapped. Throws
// InputError that names the file, UsageError where "auto" has nothing to mean.
SceneLayers ReadLayers(const LayerArguments& arguments, const MapSnapshot& map,
                       const std::filesystem::path& sequence);

// The message for true poses that LayTruePath cannot lay over a map.
std::string CannotBeLaid(const std::filesystem::path& sequence);

// ReadPointCloud, but a cloud without points is an error and points that are none are told.
PointCloud ReadDenseCloud(const std::filesystem::path& file);

// A cloud in the frame of a map.
std::shared_ptr<const ColoredPoints> PlaceCloud(const PointCloud& cloud, const Sim3d& S_map_file);

using FramePoses = std::map<std::int64_t, Rigid3d>;  // T_map_camera by index of the frame

// The poses of a trajectory.txt, whose times tell the frames of the sequence. Empty where the file is not
// there; throws InputError where it is broken.
FramePoses ReadFramePoses(const std::filesystem::path& trajectory, const Sequence& sequence);

// The frames that went into a map: their poses in the finished map and, where the sequence is still there,
// their images.
class InputFrames {
 public:
  // `map_file`: the recording, beside which trajectory.txt may lie. Poses come from that file, else from the
  // keyframes and snapshots of the recording.
  InputFrames(const RecordingReader& recording, const std::filesystem::path& map_file);

  // T_map_camera. Throws UsageError that tells which frames were tracked.
  Rigid3d PoseOf(std::int64_t frame) const;

  // True where the images are in a video that is still there.
  bool HasVideo() const { return sequence_ && !sequence_->video_path.empty(); }

  // 8UC3, as it was mapped (a resized one in that size). Throws InputError where it cannot be found or read.
  cv::Mat ImageOf(std::int64_t frame) const;

 private:
  Camera camera_;
  std::optional<Sequence> sequence_;
  FramePoses poses_;
  std::map<std::int64_t, std::string> images_;  // of snapshots, by index of the frame
  std::string why_no_sequence_;
};

}  // namespace sqslam::app
