#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "slam/snapshot/recording.h"
#include "slam/snapshot/snapshot.h"
#include "slam/system_options.h"

namespace sqslam::app {

// A frame in which an object was detected.
struct ObjectView {
  std::int64_t frame_index = 0;
  std::string image_path;
  Rigid3d T_map_camera;  // in the finished map
  Box2d box;             // the detector's, distorted px
};

// By object id and frame: the frames among the keyframes of the last map, whose poses the end of the run
// knows, with images that are still there. Of long runs an even share, or all.
std::map<int, std::vector<ObjectView>> ObjectViews(const RecordingReader& reader, const MapSnapshot& last,
                                                   bool all);

// The views of one frame, or all where none is asked for. Throws InputError that lists the frames there are.
std::vector<ObjectView> ViewsOfFrame(const std::vector<ObjectView>& views, std::optional<std::int64_t> frame,
                                     const std::string& what);

// Quarter turns clockwise after which up in the map is up in the image; 0 where the camera looks down or
// gravity is not known.
int UprightTurns(const ObjectView& view, const MapSnapshot& map);

// The configuration of the run; the defaults where it is that of another version of the program.
SystemOptions ConfigOf(const RecordingReader& reader);

// Throws InputError that lists the objects there are.
const SnapshotObject& ObjectById(const MapSnapshot& map, int id, const std::string& result);

}  // namespace sqslam::app
