#pragma once

#include <opencv2/core.hpp>

#include "slam/geometry/box2.h"

namespace sqslam {

// An image shrunk or grown to fit into a network's input without changing its aspect, in the top-left corner;
// the rest is grey (114, as networks are trained with).
class Letterbox {
 public:
  Letterbox(cv::Size image, cv::Size input);

  cv::Mat Fill(const cv::Mat& bgr) const;  // in the size of the input

  // Converts from pixels of the input to pixels of the image, clipped to it (empty where nothing is left).
  Box2d ToImage(const Box2d& box) const;

 private:
  cv::Size image_;
  cv::Size input_;
  double scale_;  // input pixels for one of the image
};

}  // namespace sqslam
