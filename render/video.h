#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <opencv2/core.hpp>
#include <string>

#include "render/picture.h"
#include "slam/io/recording.h"

namespace sqslam {

// Takes the frames of a video (FILE.mp4: H.264 where OpenCV can, else MPEG-4) or of a numbered sequence of
// pictures (a name with {frame} or {frame:04}); encodes on a thread of its own. A video appears whole at
// Close() or not at all. Throws UsageError on a name that is neither, InputError that says why a file cannot
// be written.
class FrameWriter {
 public:
  FrameWriter(const std::filesystem::path& output, cv::Size size, double fps);
  ~FrameWriter();
  FrameWriter(FrameWriter&&) noexcept;

  // Waits while the encoder is several frames behind. `number` names the file of a sequence.
  void Add(const cv::Mat& frame, int number);
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
  double fps = 30.0;
  double seconds = 10.0;   // of a video of one map; a video of growth is as long as the run, but no longer than this
  int first = 0;           // frames to write: [first, end)
  int end = -1;            // -1: to the last
  bool show_image = true;  // growth: the input image with its boxes beside the map
};

// Told after each frame; returns false to stop (what has been written of a video is then dropped).
using VideoProgress = std::function<bool(int done, int total)>;

// The finished map along a camera path: a turntable (kOrbit), or along its keyframes. Returns frames written.
int WriteOrbit(const MapSnapshot& map, const VideoOptions& options, const std::filesystem::path& output,
               const VideoProgress& progress = {});

// The map as it grew, in the run's time (each frame shows the newest snapshot of its moment): beside it the input image with the detector's boxes in the
// colours of their classes, below it a time line and counts. Framed once, for the final map. Returns frames
// written.
int WriteGrowthVideo(const RecordingReader& recording, const VideoOptions& options,
                     const std::filesystem::path& output, const VideoProgress& progress = {});

}  // namespace sqslam
