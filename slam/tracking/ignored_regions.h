#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "slam/io/frame.h"

namespace sqslam {

struct MovingOptions {
  // Classes of things that move by themselves: keypoints in their boxes are neither tracked nor mapped.
  std::vector<std::string> labels = {"person", "bird",       "cat",  "dog",   "horse",   "sheep",
                                     "cow",    "elephant",   "bear", "zebra", "giraffe", "bicycle",
                                     "car",    "motorcycle", "bus",  "train", "truck"};
  double min_score = 0.25;  // detector score below which a box is not believed, in [0, 1]
  double margin = 0.05;     // share of a box's sides by which it is enlarged all round
  double hold = 0.3;        // s that boxes hold for frames that the detector has not seen
  // Share of the image that boxes may cover. Beyond it they hide more than they help, or the thing is what is
  // filmed (somebody walks around a parked car).
  double max_share = 0.6;

  void VisitFields(auto&& visit) {
    visit("labels", labels);
    visit("min_score", min_score, 0.0, 1.0);
    visit("margin", margin, 0.0, 1.0);
    visit("hold", hold, 0.0, 10.0);
    visit("max_share", max_share, 0.0, 1.0);
  }
};

// Parts of the images that take no part in the map: those that a mask names, and boxes of things that move.
class IgnoredRegions {
 public:
  explicit IgnoredRegions(MovingOptions options) : options_(std::move(options)) {}

  // Takes the boxes of a frame. The newest that show something moving count, until they are too old.
  void See(double timestamp, const std::vector<Detection>& detections);

  // 8UC1 of the frame's size, not 0 where keypoints are ignored; empty where nothing is.
  cv::Mat In(const Frame& frame) const;

 private:
  MovingOptions options_;
  double timestamp_ = 0.0;  // of boxes_
  std::vector<Box2d> boxes_;
};

}  // namespace sqslam
