#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace sqslam {

// FAST-9/16 corners (Rosten and Drummond 2006) with a threshold that adapts to each cell of the image: where
// the usual one finds nothing, a lower one is tried. Keeps its buffers between images.
class CornerDetector {
 public:
  // Thresholds in grey levels.
  CornerDetector(int threshold, int min_threshold) : threshold_(threshold), min_threshold_(min_threshold) {}

  // Corners within `inner`, relative to its corner, in a fixed order; valid until the next call. `image` is 8
  // bit, and `inner` at least 3 pixels from its edges. Nothing where `inner` is smaller than one cell.
  const std::vector<cv::KeyPoint>& Detect(const cv::Mat& image, const cv::Rect& inner);

 private:
  // Tries the lower threshold on `cells`, given relative to the corner of `inner`.
  void DetectWeak(const cv::Mat& image, const cv::Rect& inner, const cv::Rect& cells);

  int threshold_;
  int min_threshold_;
  std::vector<cv::KeyPoint> corners_;
  std::vector<cv::KeyPoint> weak_;
  std::vector<char> filled_;  // cells, row by row
};

}  // namespace sqslam
