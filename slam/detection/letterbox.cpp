#include "slam/detection/letterbox.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace sqslam {

Letterbox::Letterbox(cv::Size image, cv::Size input)
    : image_(image),
      input_(input),
      scale_(std::min(static_cast<double>(input.width) / image.width,
                      static_cast<double>(input.height) / image.height)) {}

cv::Mat Letterbox::Fill(const cv::Mat& bgr) const {
  if (bgr.size() == input_) {
    return bgr;
  }
  constexpr double kGrey = 114.0;
  cv::Mat filled(input_, CV_8UC3, cv::Scalar::all(kGrey));
  const cv::Size inner(std::clamp(static_cast<int>(std::lround(scale_ * image_.width)), 1, input_.width),
                       std::clamp(static_cast<int>(std::lround(scale_ * image_.height)), 1, input_.height));
  cv::resize(bgr, filled(cv::Rect({0, 0}, inner)), inner, 0.0, 0.0,
             scale_ < 1.0 ? cv::INTER_AREA : cv::INTER_LINEAR);
  return filled;
}

Box2d Letterbox::ToImage(const Box2d& box) const {
  const double left = std::clamp(box.x / scale_, 0.0, static_cast<double>(image_.width));
  const double top = std::clamp(box.y / scale_, 0.0, static_cast<double>(image_.height));
  const double right = std::clamp((box.x + box.width) / scale_, 0.0, static_cast<double>(image_.width));
  const double bottom = std::clamp((box.y + box.height) / scale_, 0.0, static_cast<double>(image_.height));
  return {left, top, right - left, bottom - top};
}

}  // namespace sqslam
