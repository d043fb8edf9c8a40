#pragma once

#include <opencv2/core.hpp>

namespace sqslam {

// Offset in pixels, at most kMaxCornerOffset along each axis, from a FAST corner to the place between the
// pixels where its score is greatest. FAST itself knows whole pixels only, and on a coarse pyramid level half
// a pixel is several pixels of the image. The score is that of FAST-9/16 (Rosten and Drummond 2006): the
// greatest threshold at which the pixel is a corner. Parabolas are laid through the sums of rows and columns
// of its 3x3 neighbourhood, the middle one counted twice. `image` is 8 bit; `corner` is at least five pixels
// from its edges.
cv::Point2f RefineCorner(const cv::Mat& image, const cv::Point& corner);

inline constexpr float kMaxCornerOffset = 0.75F;

}  // namespace sqslam
