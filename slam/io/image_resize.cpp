#include "slam/io/image_resize.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <string_view>

#include "slam/util/error.h"
#include "slam/util/parse_number.h"

namespace sqslam {
namespace {

constexpr int kMinSide = 16;  // pixels; less is a slip
constexpr int kMaxSide = 16384;

bool IsSide(double number) {
  return number == std::floor(number) && number >= kMinSide && number <= kMaxSide;
}

}  // namespace

cv::Size ImageResize::Of(cv::Size image) const {
  const auto rounded = [](double side) { return std::max(1, static_cast<int>(std::lround(side))); };
  if (width <= 0) {
    return {rounded(scale * image.width), rounded(scale * image.height)};
  }
  return {width, height > 0 ? height : rounded(static_cast<double>(width) * image.height / image.width)};
}

ImageResize ParseImageResize(const std::string& text) {
  if (text.empty()) {
    return {};
  }
  const std::size_t comma = text.find(',');
  const std::optional<double> first = ParseNumber<double>(std::string_view(text).substr(0, comma));
  if (comma != std::string::npos) {
    const std::optional<double> second = ParseNumber<double>(std::string_view(text).substr(comma + 1));
    if (first && second && IsSide(*first) && IsSide(*second)) {
      return {static_cast<int>(*first), static_cast<int>(*second), 1.0};
    }
  } else if (first && *first > 0.0 && *first <= 1.0) {
    return {0, 0, *first};
  } else if (first && IsSide(*first)) {
    return {static_cast<int>(*first), 0, 1.0};
  }
  throw UsageError(fmt::format(
      "--resize {}: expected WIDTH or WIDTH,HEIGHT in pixels (from {} to {}), or a factor of at most 1", text,
      kMinSide, kMaxSide));
}

cv::Mat Resized(const cv::Mat& image, cv::Size size) {
  if (image.empty() || size.empty() || image.size() == size) {
    return image;
  }
  cv::Mat resized;
  cv::resize(image, resized, size, 0.0, 0.0, size.width < image.cols ? cv::INTER_AREA : cv::INTER_CUBIC);
  return resized;
}

cv::Mat ReadImageInSize(const std::string& path, cv::Size size) {
  return Resized(cv::imread(path, cv::IMREAD_COLOR), size);
}

}  // namespace sqslam
