#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "slam/util/atomic_file.h"
#include "slam/util/worker_thread.h"

namespace sqslam {

// Returns the number of frames in two seconds, a segment of a video. Each segment has an encoder of its own:
// pieces of whole segments join to the same file as a video that is drawn at once.
int SegmentFrames(double fps);

// Writes one video. FILE.mp4: H.264 (MPEG-4 if FFmpeg has no x264), 4:2:0, with colour tags, and with the
// last frame as the picture that stands for it in a list of files. FILE.gif (256 colours a frame) and
// FILE.webp play for ever. Calls FFmpeg's libraries directly, because OpenCV's writer does not report a full
// disk, gives white a greenish tint, does not tag the colour matrix, and cannot copy streams. Not
// thread-safe.
class VideoEncoder {
 public:
  // Both sides of an .mp4 must be even. Throws InputError that says why the file cannot be written. `name`:
  // shown in messages instead of `path`, if the file is to be renamed.
  VideoEncoder(const std::filesystem::path& path, cv::Size size, double fps,
               const std::filesystem::path& name = {});
  ~VideoEncoder();  // leaves an unfinished file incomplete
  VideoEncoder(const VideoEncoder&) = delete;
  VideoEncoder& operator=(const VideoEncoder&) = delete;

  void Add(const cv::Mat& bgr);  // 8UC3; throws InputError if it cannot be written
  void Finish();                 // throws likewise; completes the file

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// Writes a video (IsVideo) or numbered pictures (a name with {frame} or {frame:04}), encoding on a thread of
// its own. A video appears at Close(), with all frames, or not at all. Throws UsageError on any other name,
// InputError that says why a file cannot be written.
class FrameWriter {
 public:
  FrameWriter(const std::filesystem::path& output, cv::Size size, double fps);

  // Blocks while the encoder is several frames behind. `number`: for the file name of a picture.
  void Add(const cv::Mat& frame, int number);

  // Finishes the file and renames it. Throws InputError if it cannot be written.
  void Close();

 private:
  struct Job {
    cv::Mat frame;
    int number;
  };
  void Write(const Job& job);

  std::filesystem::path output_;
  int added_ = 0;
  std::optional<AtomicPath> file_;             // the video, if any
  std::optional<VideoEncoder> video_;          // empty: numbered pictures
  std::optional<WorkerThread<Job>> encoding_;  // last: uses the other members
};

// Concatenates videos of equal size, frame rate and coding without re-encoding. `frames`: of each video.
// `progress` is called after each frame and may stop; the file then ends there. Returns the number of frames
// written. Throws InputError that names a video that does not match or cannot be read, or says why the output
// cannot be written.
int ConcatenateVideos(const std::vector<std::filesystem::path>& videos, const std::vector<int>& frames,
                      const std::filesystem::path& output,
                      const std::function<bool(int done, int total)>& progress = {});

}  // namespace sqslam
