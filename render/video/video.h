#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "render/picture/picture.h"
#include "render/video/camera_path_file.h"
#include "slam/snapshot/recording.h"

namespace sqslam {

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

// Takes the frames of a video (FILE.mp4: H.264 where OpenCV can, else MPEG-4) or of a numbered sequence of
// pictures (a name with {frame} or {frame:04}); encodes on a thread of its own. A video appears at Close(),
// with all frames added until then, or not at all. Throws UsageError on a name that is neither, InputError
// that says why a file cannot be written.
class FrameWriter {
 public:
  FrameWriter(const std::filesystem::path& output, cv::Size size, double fps);
  ~FrameWriter();
  FrameWriter(FrameWriter&&) noexcept;

  // Waits while the encoder is several frames behind. `number` names the file of a sequence.
  void Add(const cv::Mat& frame, int number);

  // Ends the file, reads it back, and gives it its name. Throws InputError where frames are missing in it.
  void Close();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// True where the name has a {frame} field; FrameName fills it in.
bool IsFrameTemplate(const std::string& name);
std::string FrameName(const std::string& name, int number);

enum class CameraPath { kStill, kOrbit, kFollow, kFirstPerson };

struct VideoOptions {
  PictureOptions picture;  // width and height: of the whole frame
  CameraPath path = CameraPath::kOrbit;
  std::optional<CameraPathFile> path_file;  // instead of `path`
  FramePoses frame_poses;                   // for the keys of path_file that name frames of the run
  double fps = 30.0;
  // Of a video of one map, unless path_file says; a video of growth is as long as the run, but no longer.
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
