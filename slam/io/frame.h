#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "slam/geometry/box2.h"

namespace sqslam {

// One decoded image with its boxes.
struct Frame {
  std::int64_t index = 0;  // position in the sequence (0-based, counts skipped frames)
  double timestamp = 0.0;  // seconds
  std::string image_path;  // absolute; empty if there is no file
  cv::Mat bgr;             // 8UC3, as recorded (distorted)
  cv::Mat gray;            // 8UC1
  cv::Mat ignored;         // 8UC1, nonzero where nothing is tracked: masked or fixed regions; may be empty
  int quarter_turns = 0;   // clockwise, from the image as shown to `bgr` (QuarterTurnsTo)
  std::vector<Detection> detections;
  bool detections_follow = false;  // a detector delivers them later, see System::AddDetections
};

}  // namespace sqslam
