#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <opencv2/core.hpp>
#include <vector>

namespace sqslam {

// Writes one MP4 file: H.264 (MPEG-4 where FFmpeg has no x264), 4:2:0, its colours tagged. FFmpeg's libraries
// are called directly because OpenCV's writer tells nobody of a full disk, rounds white to a greenish tint,
// leaves players to guess the colour matrix, and cannot copy streams. Belongs to one thread at a time.
class VideoEncoder {
 public:
  // Both sides even. Throws InputError that says why the file cannot be written.
  VideoEncoder(const std::filesystem::path& path, cv::Size size, double fps);
  ~VideoEncoder();  // of an unfinished one: closes the file as it is
  VideoEncoder(const VideoEncoder&) = delete;
  VideoEncoder& operator=(const VideoEncoder&) = delete;

  void Add(const cv::Mat& bgr);  // 8UC3; throws InputError where it cannot be written
  void Finish();                 // the same; afterwards the file is whole

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// Appends the streams of videos of one size, rate and coding to one file, as they are. `frames`: of each
// video. `progress` is told after each frame and may stop; the file then ends there. Returns frames written.
// Throws InputError that names the video that does not fit or cannot be read, or why the output cannot be
// written.
int CopyVideos(const std::vector<std::filesystem::path>& videos, const std::vector<int>& frames,
               const std::filesystem::path& output,
               const std::function<bool(int done, int total)>& progress = {});

}  // namespace sqslam
