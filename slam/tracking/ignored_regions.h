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
  double min_score = 0.25;  // detections with a lower score are ignored, in [0, 1]
  double margin = 0.05;     // share of a box's width and height added on each side
  double hold = 0.3;        // s, maximum time between a frame and the boxes that apply to it
  // Share of the image above which boxes are ignored: they hide more than they help, or the object is the
  // subject of the video (somebody walks around a parked car).
  double max_share = 0.6;

  void VisitFields(auto&& visit) {
    visit("labels", labels);
    visit("min_score", min_score, 0.0, 1.0);
    visit("margin", margin, 0.0, 1.0);
    visit("hold", hold, 0.0, 10.0);
    visit("max_share", max_share, 0.0, 1.0);
  }
};

// Regions of the images to keep out of the map: masked ones, and boxes of objects that move.
class IgnoredRegions {
 public:
  explicit IgnoredRegions(MovingOptions options) : options_(std::move(options)) {}

  // Takes a frame's detections. Boxes of moving classes replace older ones; if there are none, those stay.
  void See(double timestamp, const std::vector<Detection>& detections);

  // Returns an 8UC1 mask of the frame's size, nonzero where keypoints are ignored; may be empty.
  cv::Mat In(const Frame& frame) const;

 private:
  MovingOptions options_;
  double timestamp_ = 0.0;  // of boxes_
  std::vector<Box2d> boxes_;
};

}  // namespace sqslam
