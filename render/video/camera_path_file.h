#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "render/picture/picture.h"

namespace sqslam {

// Place of a virtual camera at one moment, as a camera path file says it: exactly one of a named view, a pose
// of the input camera, or a position with its focal point; what else is given overrides that.
struct CameraKey {
  int line = 0;                              // of the file, from 1
  std::optional<double> time;                // seconds
  std::string view;                          // a name of render/camera/view_presets.h, or "default"
  std::optional<std::int64_t> keyframe;      // id of a keyframe of the map
  std::optional<std::int64_t> camera_frame;  // frame of the run
  CameraOverrides overrides;                 // position, focal_point, view_up, view_angle, azimuth, ...
};

// A camera path of key frames, read from YAML:
//
//   easing: smooth      # at rest at both ends; linear: starts and ends in full motion (default: smooth)
//   loop: false         # true: goes on from the last key to the first
//   duration: 8         # seconds, with loop until it is back at the first key; default: the last key's time
//   keys:
//     - {time: 0, view: front}                    # front, right, back, left, top, isometric, default
//     - {time: 3, keyframe: 12}                   # as the input camera stood at this keyframe
//     - {time: 5, camera_frame: 240}              # ... at this frame of the run
//     - {time: 8, position: [1, -2, 1], focal_point: [0, 0, 0], view_up: [0, 0, 1], view_angle: 30}
//
// `frame: N` of the video may stand instead of `time`; without either, the keys are spread evenly. azimuth,
// elevation (degrees) and zoom change any key as they do on the command line.
struct CameraPathFile {
  std::filesystem::path path;
  bool smooth = true;
  bool loop = false;
  std::optional<double> duration;  // seconds
  std::vector<CameraKey> keys;     // with rising times, or all without

  // Seconds that the path takes; empty where nothing in the file says.
  std::optional<double> Length() const;
};

// `fps` turns frames into seconds. Throws UsageError that names file, line, key and what was expected.
CameraPathFile ReadCameraPath(const std::filesystem::path& path, double fps);

// The pose T_map_camera of the input camera at a frame of the run. Throws UsageError where it was not
// tracked.
using FramePoses = std::function<Rigid3d(std::int64_t frame)>;

// The views of a video of `frames` frames: focal points, directions and distances from there, up and view
// angles run along cubic splines through the keys (Catmull-Rom, with tangents that take the times between
// keys into account, so that no key is felt as a jolt). Keys without times are spread over the video. Throws
// UsageError that names file, line and key.
std::vector<ViewCamera> ViewsAlong(const CameraPathFile& file, const MapSnapshot& map,
                                   const PictureOptions& options, const FramePoses& frame_poses, int frames,
                                   double fps);

}  // namespace sqslam
