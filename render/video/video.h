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

// One of several equal pieces of a video, for as many programs at once.
struct Shard {
  int index = 1;  // from 1
  int count = 1;
};

// "2/8". Throws UsageError on anything but 1 <= I <= N.
Shard ParseShard(const std::string& text);

// The frames of [first, end) that the shard makes: [first, second).
std::pair<int, int> FramesOf(const Shard& shard, int first, int end);

// a/turn.mp4 -> a/turn.part-2-of-8.mp4. A numbered name stays: its files have the numbers of their frames.
std::filesystem::path PartName(const std::filesystem::path& output, const Shard& shard);

// True where the name has a {frame} field; FrameName fills it in.
bool IsFrameTemplate(const std::string& name);
std::string FrameName(const std::string& name, int number);

enum class CameraPath { kStill, kOrbit, kFollow, kFirstPerson };
constexpr auto EnumNames(CameraPath) { return std::array{"still", "orbit", "follow", "first-person"}; }

struct VideoOptions {
  PictureOptions picture;  // width and height: of the whole frame
  CameraPath path = CameraPath::kOrbit;
  std::optional<CameraPathFile> path_file;  // instead of `path`
  FramePoses frame_poses;                   // for the keys of path_file that name frames of the run
  double fps = 30.0;
  // The length of a video of one map, unless path_file has one; for growth an upper limit to that of the run.
  double seconds = 10.0;
  int first = 0;           // frames to write: [first, end)
  int end = -1;            // -1: to the last
  Shard shard;             // of these, the part to write; the caller names the file (PartName)
  bool show_image = true;  // growth: the input image with its boxes beside the map
};

// Told after each frame; returns false to stop: a video then ends with this frame.
using VideoProgress = std::function<bool(int done, int total)>;

// The finished map along a camera path: a turntable (kOrbit), or along its keyframes. Returns frames written.
int WriteOrbit(const MapSnapshot& map, const VideoOptions& options, const std::filesystem::path& output,
               const VideoProgress& progress = {});

// The map as it grew, in the run's time (each frame shows the newest snapshot of its moment): beside it the
// input image with the detector's boxes and the outlines of the objects in the colours of their classes,
// below it a time line with the keyframes, and counts. Framed once, for the final map. Draws the map, puts
// pages together and encodes on three threads. Returns frames written.
int WriteGrowthVideo(const RecordingReader& recording, const VideoOptions& options,
                     const std::filesystem::path& output, const VideoProgress& progress = {});

// Puts videos made by shards, or numbered pictures, together in order: `pieces` are FILE.part-I-of-N.mp4 in
// any order, or pictures with numbers in their names, or one name with {frame:04}. `fps` is that of pictures;
// videos keep theirs, and are put together as they are, without encoding them anew.
// Returns frames written. Throws InputError that names what is missing (parts, numbers), double, of another
// size or rate, of another video, or cut short.
int JoinVideo(const std::vector<std::string>& pieces, const std::filesystem::path& output, double fps,
              const VideoProgress& progress = {});

}  // namespace sqslam
