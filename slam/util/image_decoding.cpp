#include "slam/util/image_decoding.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "slam/util/limits.h"

namespace sqslam {
namespace {

thread_local bool decoding = false;

// Refuses to allocate the pixels of an image that is too large. OpenCV's own limits are environment
// variables, which it reads before main() can set them.
class ImageAllocator : public cv::MatAllocator {
 public:
  cv::UMatData* allocate(int dims, const int* sizes, int type, void* data, std::size_t* step,
                         cv::AccessFlag access, cv::UMatUsageFlags usage) const override {
    if (decoding && dims == 2 && IsTooLarge({sizes[1], sizes[0]})) {
      CV_Error(cv::Error::StsNoMem, "the image is too large");
    }
    return cv::Mat::getStdAllocator()->allocate(dims, sizes, type, data, step, access, usage);
  }
  bool allocate(cv::UMatData* data, cv::AccessFlag access, cv::UMatUsageFlags usage) const override {
    return cv::Mat::getStdAllocator()->allocate(data, access, usage);
  }
  void deallocate(cv::UMatData* data) const override { cv::Mat::getStdAllocator()->deallocate(data); }
};

// Installed before main(): replacing the allocator would race with other threads.
[[maybe_unused]] const bool kIsInstalled = [] {
  static ImageAllocator allocator;
  cv::Mat::setDefaultAllocator(&allocator);
  return true;
}();

// Returns true for the formats whose decoders read the size without decoding pixels.
bool HasKnownFormat(std::string_view bytes) {
  using namespace std::string_view_literals;
  constexpr std::array kSignatures = {"\x89PNG"sv, "\xFF\xD8"sv, "BM"sv, "P1"sv,    "P2"sv,    "P3"sv,
                                      "P4"sv,      "P5"sv,       "P6"sv, "II*\0"sv, "MM\0*"sv, "RIFF"sv};
  return std::ranges::any_of(kSignatures,
                             [&](std::string_view signature) { return bytes.starts_with(signature); });
}

// Returns true if OpenCV or ImageAllocator refused an image for its size.
bool RefusesSize(const cv::Exception& error) {
  return error.code == cv::Error::StsNoMem || error.err.find("CV_IO_MAX_IMAGE") != std::string::npos;
}

}  // namespace

bool IsTooLarge(const cv::Size& size) {
  return std::max(size.width, size.height) > kMaxImageSide ||
         std::int64_t{size.width} * size.height > kMaxImagePixels;
}

DecodedImage DecodeImage(std::string_view bytes, int flags) {
  DecodedImage decoded;
  if (HasKnownFormat(bytes)) {
    const std::vector<unsigned char> copy(bytes.begin(), bytes.end());  // OpenCV's decoder takes no view
    decoding = true;
    try {
      decoded.pixels = cv::imdecode(copy, flags);
    } catch (const cv::Exception& error) {
      decoded.too_large = RefusesSize(error);
    }
    decoding = false;
  }
  if (decoded.too_large) {
    decoded.problem = fmt::format("is too large, expected at most {} pixels a side and {} in all",
                                  kMaxImageSide, kMaxImagePixels);
  } else if (decoded.pixels.empty()) {
    decoded.problem = "cannot be decoded";
  }
  return decoded;
}

}  // namespace sqslam
