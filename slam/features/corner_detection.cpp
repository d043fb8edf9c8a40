#include "slam/features/corner_detection.h"

#include <opencv2/features2d.hpp>

namespace sqslam {
namespace {

constexpr int kCellSize = 32;   // at least, pixels
constexpr int kFastRadius = 3;  // pixels that FAST leaves out at the edges

cv::Rect Grown(const cv::Rect& area) {
  return {area.x - kFastRadius, area.y - kFastRadius, area.width + 2 * kFastRadius,
          area.height + 2 * kFastRadius};
}

// Cell `index` of `cells` begins at pixel length * index / cells.
int CellAt(float place, int length, int cells) {
  return ((static_cast<int>(place) + 1) * cells - 1) / length;
}

}  // namespace

const std::vector<cv::KeyPoint>& CornerDetector::Detect(const cv::Mat& image, const cv::Rect& inner) {
  corners_.clear();
  if (inner.width < kCellSize || inner.height < kCellSize) {
    return corners_;
  }
  cv::FAST(image(Grown(inner)), corners_, threshold_, true);
  const int columns = inner.width / kCellSize;
  const int rows = inner.height / kCellSize;
  filled_.assign(static_cast<std::size_t>(columns * rows), 0);
  for (cv::KeyPoint& corner : corners_) {
    corner.pt -= cv::Point2f(kFastRadius, kFastRadius);
    filled_[static_cast<std::size_t>(CellAt(corner.pt.y, inner.height, rows) * columns +
                                     CellAt(corner.pt.x, inner.width, columns))] = 1;
  }
  for (int row = 0; row < rows; ++row) {
    const int y0 = inner.height * row / rows;
    const int y1 = inner.height * (row + 1) / rows;
    const char* filled = &filled_[static_cast<std::size_t>(row * columns)];
    // Empty neighbours at once: each call of FAST has its price.
    for (int begin = 0, end = 0; begin < columns; begin = end + 1) {
      for (end = begin; end < columns && filled[end] == 0; ++end) {
      }
      if (end > begin) {
        const int x0 = inner.width * begin / columns;
        const int x1 = inner.width * end / columns;
        DetectWeak(image, inner, {x0, y0, x1 - x0, y1 - y0});
      }
    }
  }
  return corners_;
}

void CornerDetector::DetectWeak(const cv::Mat& image, const cv::Rect& inner, const cv::Rect& cells) {
  cv::FAST(image(Grown(cells + inner.tl())), weak_, min_threshold_, true);
  for (cv::KeyPoint& corner : weak_) {
    corner.pt += cv::Point2f(cells.tl()) - cv::Point2f(kFastRadius, kFastRadius);
    corners_.push_back(corner);
  }
}

}  // namespace sqslam
