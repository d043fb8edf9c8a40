#pragma once

#include <filesystem>
#include <opencv2/core.hpp>

#include "render/video/video_encoder.h"

namespace sqslam::viewer {

// Films what is on the screen at a steady rate, however unevenly its frames come. All throw InputError where
// the file cannot be written.
class VideoRecorder {
 public:
  static constexpr double kRate = 25.0;  // frames a second

  VideoRecorder(const std::filesystem::path& file, cv::Size size);

  // The picture that was on the screen for the last `seconds`; another size than at first is scaled to it.
  void Add(const cv::Mat& bgr, double seconds);
  void Finish();

  const std::filesystem::path& File() const { return file_; }

 private:
  std::filesystem::path file_;
  cv::Size size_;
  VideoEncoder encoder_;
  double due_ = 0.0;  // seconds that were shown but not written yet
};

}  // namespace sqslam::viewer
