#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "slam/geometry/box2.h"

namespace sqslam {

// A box as decoded from a network, in pixels of its input.
struct ScoredBox {
  Box2d box;
  int class_number = 0;
  double score = 0.0;  // in [0, 1]
};

// The decoders return the boxes of a network's output with a score of at least `threshold`, before
// non-maximum suppression. They throw InputError with the expected shape for any other shape.

// YOLOX (Ge et al., 2021): `output` 1 x N x (5 + classes) with centre, logarithm of the size, objectness and
// class scores for each cell of the grids of stride 8, 16 and 32, row by row. A score is objectness times
// class score.
std::vector<ScoredBox> DecodeYolox(const cv::Mat& output, cv::Size input, int classes, double threshold);

// CenterNet (Zhou et al., 2019) with sides: `heatmap` 1 x classes x H/4 x W/4 of scores, whose maxima over 3
// x 3 cells are the centres, and `sides` 1 x 4 x H/4 x W/4, distances to the left, top, right and bottom
// edge. Returns at most `count` boxes, strongest first.
std::vector<ScoredBox> DecodeCenterNet(const cv::Mat& heatmap, const cv::Mat& sides, cv::Size input,
                                       int classes, double threshold, int count);

// YOLOv8 and compatible networks: `output` 1 x (4 + classes) x N with centre, size and class scores.
std::vector<ScoredBox> DecodeYoloV8(const cv::Mat& output, int classes, double threshold);

// Non-maximum suppression within each class: drops the weaker of two boxes that overlap by more than
// `iou`. Returns the strongest box first; equal scores keep their order.
std::vector<ScoredBox> SuppressNonMaxima(std::vector<ScoredBox> boxes, double iou);

// Resizes an image to fit into a network's input, keeping its aspect ratio, in the top-left corner; the rest
// is grey (114, as in training).
class Letterbox {
 public:
  Letterbox(cv::Size image, cv::Size input);

  cv::Mat Fill(const cv::Mat& bgr) const;  // in the size of the input

  // Converts from pixels of the input to pixels of the image, clipped to it (empty if nothing is left).
  Box2d ToImage(const Box2d& box) const;

 private:
  cv::Size image_;
  cv::Size input_;
  double scale_;  // input pixels per image pixel
};

}  // namespace sqslam
