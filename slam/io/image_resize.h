#pragma once

#include <opencv2/core.hpp>
#include <string>

namespace sqslam {

// Size that images are brought to before they are used.
struct ImageResize {
  int width = 0;       // pixels; 0: by the scale
  int height = 0;      // pixels; 0: as the width and the image's proportions have it
  double scale = 1.0;  // used where there is no width

  bool Changes() const { return width > 0 || scale != 1.0; }
  cv::Size Of(cv::Size image) const;  // at least one pixel each way
};

// "640", "640,480" (pixels) or "0.5" (a factor, at most 1). Throws UsageError for anything else; empty: as
// they are.
ImageResize ParseImageResize(const std::string& text);

// The image in another size, averaged over the pixels that fall together; itself where it has that size or
// none is given.
cv::Mat Resized(const cv::Mat& image, cv::Size size);

// A file's image in this size, 8UC3; empty where it cannot be read.
cv::Mat ReadImageInSize(const std::string& path, cv::Size size);

}  // namespace sqslam
