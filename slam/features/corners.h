#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace sqslam {

// FAST-9/16 corners (Rosten and Drummond 2006) with a threshold per cell of the image: if the usual one finds
// nothing, a lower one is tried. Reuses its buffers between images.
class CornerDetector {
 public:
  // Thresholds in grey levels.
  CornerDetector(int threshold, int min_threshold) : threshold_(threshold), min_threshold_(min_threshold) {}

  // Returns the corners within `inner`, relative to its top-left corner, in a fixed order; valid until the
  // next call. `image` is 8 bit, `inner` at least 3 pixels from its edges. None if `inner` is smaller than a
  // cell.
  const std::vector<cv::KeyPoint>& Detect(const cv::Mat& image, const cv::Rect& inner);

 private:
  // Tries the lower threshold on `cells`, relative to the top-left corner of `inner`.
  void DetectWeak(const cv::Mat& image, const cv::Rect& inner, const cv::Rect& cells);

  int threshold_;
  int min_threshold_;
  std::vector<cv::KeyPoint> corners_;
  std::vector<cv::KeyPoint> weak_;
  std::vector<char> filled_;  // cells, row by row
};

// Returns true if a pixel, at least four from the edges of an 8 bit image, lies on a straight edge: by the
// criterion of Harris and Stephens (1988), det(A) <= 0.04 trace(A)^2 for the structure tensor A of its 7x7
// neighbourhood. FAST finds corners along edges that are neither quite horizontal nor vertical; they slide
// along them as the camera moves, agree with each other, and pull the scale of the map.
bool IsOnEdge(const cv::Mat& image, const cv::Point& pixel);

// Returns the offset in pixels, at most kMaxCornerOffset along each axis, from a FAST corner to the sub-pixel
// maximum of its score. FAST only returns integer pixels, and on a coarse pyramid level half a pixel is
// several pixels of the image. The score is that of FAST-9/16 (Rosten and Drummond 2006): the greatest
// threshold at which the pixel is a corner. Parabolas are fitted to the sums of rows and columns of its 3x3
// neighbourhood, with double weight on the middle. `image` is 8 bit; `corner` is at least five pixels from
// its edges.
cv::Point2f RefineCorner(const cv::Mat& image, const cv::Point& corner);

inline constexpr float kMaxCornerOffset = 0.75F;

// Selects about `count` corners that cover the image evenly, as ORB-SLAM's extractor does (Mur-Artal et al.
// 2015, V-A, and its code): splits the area as a quadtree until it has `count` non-empty leaves, and keeps
// the strongest corner of each.
std::vector<cv::KeyPoint> DistributeByQuadtree(const std::vector<cv::KeyPoint>& corners, cv::Size area,
                                               int count);

}  // namespace sqslam
