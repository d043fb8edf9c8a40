#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "render/picture/picture.h"
#include "slam/snapshot/recording.h"
#include "slam/util/shard.h"

namespace sqslam {

// A key of a camera path file: exactly one of a named view, a pose of the input camera, or a position with a
// focal point; other values override it.
struct CameraKey {
  int line = 0;                              // in the file, from 1
  std::optional<double> time;                // seconds
  std::string view;                          // a preset (ViewPresetNames), or "default"
  std::optional<std::int64_t> keyframe;      // id of a keyframe of the map
  std::optional<std::int64_t> camera_frame;  // index of a frame of the run
  CameraOverrides overrides;                 // position, focal_point, view_up, view_angle, azimuth, ...
};

// A camera path of key frames, read from YAML:
//
//   easing: smooth      # at rest at both ends; linear: starts and ends in full motion (default: smooth)
//   loop: false         # true: continues from the last key to the first
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
  std::vector<CameraKey> keys;     // with increasing times, or all without times

  // Returns the length of the path in seconds; nullopt if the file does not determine it.
  std::optional<double> Length() const;
};

// `fps` converts frames to seconds. Throws UsageError that names file, line, key and what was expected.
CameraPathFile ReadCameraPath(const std::filesystem::path& path, double fps);

// Returns the input camera's pose T_map_camera at a frame of the run. Throws UsageError if it was not
// tracked.
using FramePoses = std::function<Rigid3d(std::int64_t frame)>;

// Returns the views of a video of `frames` frames. Focal point, direction and distance from it, up vector and
// view angle follow cubic splines through the keys (Catmull-Rom with tangents for uneven key times, so that
// the motion is smooth at keys). Keys without times are spread over the video. Throws UsageError that names
// file, line and key.
std::vector<ViewCamera> ViewsAlong(const CameraPathFile& file, const MapSnapshot& map,
                                   const PictureOptions& options, const FramePoses& frame_poses, int frames,
                                   double fps);

// Returns true if the name has a {frame} field, which FrameName fills in.
bool IsFrameTemplate(const std::string& name);
std::string FrameName(const std::string& name, int number);

// Returns true for the names of videos that can be written: FILE.mp4, FILE.gif and FILE.webp.
bool IsVideo(const std::filesystem::path& path);

enum class CameraPath { kStill, kOrbit, kFollow, kFirstPerson };
constexpr auto EnumNames(CameraPath) { return std::array{"still", "orbit", "follow", "first-person"}; }

inline constexpr double kGrowthSeconds = 20.0;  // default limit on the length of a growth video

struct VideoOptions {
  PictureOptions picture;  // width and height: of the whole frame
  CameraPath path = CameraPath::kOrbit;
  std::optional<CameraPathFile> path_file;  // instead of `path`
  FramePoses frame_poses;                   // for the keys of path_file that name frames of the run
  double fps = 30.0;
  // Length of a video of one map, unless path_file has one; for growth, an upper limit on the run's length.
  double seconds = 10.0;
  int first = 0;  // frames to write: [first, end)
  int end = -1;   // -1: through the last frame
  // Part of these frames to write; the caller names the file (PartName). The joined parts give the same file
  // as a video drawn at once.
  Shard shard;
  bool show_image = true;  // growth: the input image with its boxes beside the map
};

// Called after each frame; returns false to stop, and the video then ends with this frame.
using VideoProgress = std::function<bool(int done, int total)>;

// Writes a video of the finished map along a camera path. Returns the number of frames written.
int WriteOrbit(const MapSnapshot& map, const VideoOptions& options, const std::filesystem::path& output,
               const VideoProgress& progress = {});

// Writes a video of the map's growth in the run's time (each frame shows the newest snapshot). Beside the map
// are the input image with the detector's boxes and the objects' outlines in the colours of their classes,
// below it a timeline with the keyframes, and counts. Framed once, for the final map. Draws, composes and
// encodes on three threads. Returns the number of frames written.
int WriteGrowthVideo(const RecordingReader& recording, const VideoOptions& options,
                     const std::filesystem::path& output, const VideoProgress& progress = {});

// Joins the parts of a video, or numbered pictures. `pieces`: FILE.part-I-of-N.mp4 in any order, or pictures
// with numbers in their names, or one name with {frame:04}. `fps` applies to pictures; parts of a video keep
// theirs and are copied without re-encoding. Returns the number of frames written. Throws InputError on
// pieces that are missing, duplicate, truncated, of another video, or of different size or frame rate.
int JoinVideo(const std::vector<std::string>& pieces, const std::filesystem::path& output, double fps,
              const VideoProgress& progress = {});

}  // namespace sqslam
