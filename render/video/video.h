#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

#include "render/picture/picture.h"
#include "render/video/camera_path_file.h"
#include "render/video/video_parts.h"
#include "slam/snapshot/recording.h"

namespace sqslam {

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

}  // namespace sqslam
