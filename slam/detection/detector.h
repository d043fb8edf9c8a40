#pragma once

#include <memory>
#include <opencv2/core.hpp>
#include <vector>

#include "slam/detection/network_options.h"
#include "slam/geometry/detection.h"

namespace sqslam {

// A network that finds things in images, run by OpenCV on the processor. Used by one thread at a time.
class Detector {
 public:
  // Throws InputError that names the file: no ONNX network that OpenCV can read, unknown output names (with
  // those there are), an output whose shape the decoder or the number of classes does not fit. The last is
  // found by a trial run.
  explicit Detector(const NetworkOptions& options);
  ~Detector();
  Detector(Detector&&) noexcept;

  // Boxes of an image (8UC3) in its own pixels, clipped to it, strongest first.
  std::vector<Detection> Detect(const cv::Mat& bgr);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sqslam
