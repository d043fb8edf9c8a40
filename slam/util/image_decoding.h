#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <string_view>

namespace sqslam {

// Returns true if a side is longer than kMaxImageSide, or if there are more than kMaxImagePixels.
bool IsTooLarge(const cv::Size& size);

struct DecodedImage {
  cv::Mat pixels;
  std::string problem = {};  // empty if the image is fine, else the rest of a sentence: "cannot be decoded"
  bool too_large = false;
};

// Decodes the bytes of a JPEG, PNG, BMP, PNM, TIFF or WebP file with OpenCV's flags (cv::IMREAD_COLOR, ...).
// An image whose header claims too many pixels is refused before memory is taken for them.
DecodedImage DecodeImage(std::string_view bytes, int flags);

}  // namespace sqslam
