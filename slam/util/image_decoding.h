#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <string_view>

namespace sqslam {

// Returns the size that the header of a JPEG, PNG, BMP, PNM, TIFF or WebP file claims, in pixels: it decides
// how much memory decoding takes. A TIFF file's tiles count if they are larger than its image. Empty for
// other files and for a header that is cut off.
std::optional<cv::Size> SizeInHeader(std::string_view bytes);

// True if a side is longer than kMaxImageSide, or if there are more than kMaxImagePixels.
bool IsTooLarge(const cv::Size& size);

struct DecodedImage {
  cv::Mat pixels;
  std::string problem;  // empty if the image is fine, else the rest of a sentence: "is no readable image"
};

// Decodes the bytes of a JPEG, PNG, BMP, PNM, TIFF or WebP file with OpenCV's flags (cv::IMREAD_COLOR, ...).
// An image whose header claims sides beyond kMaxImageSide is not decoded.
DecodedImage DecodeImage(std::string_view bytes, int flags);

}  // namespace sqslam
