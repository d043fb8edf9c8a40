#include "app/viewer/state/video_recorder.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

namespace sqslam::viewer {
namespace {

cv::Size Even(cv::Size size) { return {std::max(2, size.width / 2 * 2), std::max(2, size.height / 2 * 2)}; }

}  // namespace

VideoRecorder::VideoRecorder(const std::filesystem::path& file, cv::Size size)
    : file_(file), size_(Even(size)), encoder_(file, size_, kRate) {}

void VideoRecorder::Add(const cv::Mat& bgr, double seconds) {
  constexpr double kLongest = 1.0;  // a window that rests is not filmed for longer
  due_ += std::min(seconds, kLongest);
  if (due_ < 1.0 / kRate || bgr.empty()) {
    return;
  }
  cv::Mat frame = bgr;
  if (frame.size() != size_) {
    const bool cut = frame.cols - size_.width <= 1 && frame.rows - size_.height <= 1 &&
                     frame.cols >= size_.width && frame.rows >= size_.height;
    if (cut) {  // an odd side
      frame = frame(cv::Rect(cv::Point(), size_)).clone();
    } else {
      cv::resize(bgr, frame, size_, 0.0, 0.0, cv::INTER_AREA);
    }
  }
  for (; due_ >= 1.0 / kRate; due_ -= 1.0 / kRate) {
    encoder_.Add(frame);
  }
}

void VideoRecorder::Finish() { encoder_.Finish(); }

}  // namespace sqslam::viewer
