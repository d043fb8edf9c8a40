#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "slam/io/frame.h"

namespace sqslam {

struct MovingOptions {
  // Classes that move by themselves: keypoints in their boxes are neither tracked nor mapped.
  std::vector<std::string> labels = {"person", "bird",       "cat",  "dog",   "horse",   "sheep",
                                     "cow",    "elephant",   "bear", "zebra", "giraffe", "bicycle",
                                     "car",    "motorcycle", "bus",  "train", "truck"};

  void VisitFields(auto&& visit) { visit("labels", labels); }
};

// Regions of the images to keep out of the map: masked ones, and boxes of objects that move.
class IgnoredRegions {
 public:
  explicit IgnoredRegions(MovingOptions options) : labels_(std::move(options.labels)) {}

  // Takes a frame's detections. Boxes of moving classes replace older ones; without any, the older ones stay:
  // detectors miss objects now and then.
  void AddDetections(double timestamp, const std::vector<Detection>& detections);

  // Returns an 8UC1 mask of the frame's size, nonzero where keypoints are ignored; may be empty.
  cv::Mat MaskOf(const Frame& frame) const;

 private:
  std::vector<std::string> labels_;
  double timestamp_ = 0.0;  // of boxes_
  std::vector<Box2d> boxes_;
};

}  // namespace sqslam
