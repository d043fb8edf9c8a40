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

// Writes one MP4 file: H.264 (MPEG-4 where FFmpeg has no x264), 4:2:0, its colours tagged. FFmpeg's libraries
// are called directly because OpenCV's writer tells nobody of a full disk, rounds white to a greenish tint,
// leaves players to guess the colour matrix, and cannot copy streams. Belongs to one thread at a time.
class VideoEncoder {
 public:
  // Both sides even. Throws InputError that says why the file cannot be written; messages call it `name`
  // where it will get another.
  VideoEncoder(const std::filesystem::path& path, cv::Size size, double fps,
               const std::filesystem::path& name = {});
  ~VideoEncoder();  // of an unfinished one: closes the file as it is
  VideoEncoder(const VideoEncoder&) = delete;
  VideoEncoder& operator=(const VideoEncoder&) = delete;

  void Add(const cv::Mat& bgr);  // 8UC3; throws InputError where it cannot be written
  void Finish();                 // the same; afterwards the file is whole

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// Takes the frames of a video (FILE.mp4) or of a numbered sequence of pictures (a name with {frame} or
// {frame:04}); encodes on a thread of its own. A video appears at Close(), with all frames added until then,
// or not at all. Throws UsageError on a name that is neither, InputError that says why a file cannot be
// written.
class FrameWriter {
 public:
  FrameWriter(const std::filesystem::path& output, cv::Size size, double fps);

  // Waits while the encoder is several frames behind. `number` names the file of a sequence.
  void Add(const cv::Mat& frame, int number);

  // Ends the file, reads it back, and gives it its name. Throws InputError where frames are missing in it.
  void Close();

 private:
  struct Job {
    cv::Mat frame;
    int number;
  };
  void OpenVideo(cv::Size size, double fps);
  void Write(const Job& job);
  void CheckVideo() const;

  std::filesystem::path output_;
  int added_ = 0;
  std::optional<AtomicPath> file_;             // of a video
  std::optional<VideoEncoder> video_;          // or numbered pictures
  std::optional<WorkerThread<Job>> encoding_;  // last: it uses the rest
};

// Appends the streams of videos of one size, rate and coding to one file, as they are. `frames`: of each
// video. `progress` is told after each frame and may stop; the file then ends there. Returns frames written.
// Throws InputError that names the video that does not fit or cannot be read, or why the output cannot be
// written.
int CopyVideos(const std::vector<std::filesystem::path>& videos, const std::vector<int>& frames,
               const std::filesystem::path& output,
               const std::function<bool(int done, int total)>& progress = {});

}  // namespace sqslam
