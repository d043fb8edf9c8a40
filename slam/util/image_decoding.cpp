#include "slam/util/image_decoding.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "slam/util/limits.h"

namespace sqslam {
namespace {

enum class ByteOrder { kBigEndian, kLittleEndian };

// Returns the unsigned number of `count` bytes, at most four; 0 beyond the end of the file.
std::int64_t NumberAt(std::string_view bytes, std::size_t at, std::size_t count, ByteOrder order) {
  if (at > bytes.size() || bytes.size() - at < count) {
    return 0;
  }
  std::int64_t value = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t byte = order == ByteOrder::kBigEndian ? i : count - 1 - i;
    value = 256 * value + static_cast<unsigned char>(bytes[at + byte]);
  }
  return value;
}

std::int64_t BigAt(std::string_view bytes, std::size_t at, std::size_t count) {
  return NumberAt(bytes, at, count, ByteOrder::kBigEndian);
}

std::int64_t LittleAt(std::string_view bytes, std::size_t at, std::size_t count) {
  return NumberAt(bytes, at, count, ByteOrder::kLittleEndian);
}

cv::Size Pixels(std::int64_t width, std::int64_t height) {
  const auto side = [](std::int64_t pixels) {
    return static_cast<int>(std::min<std::int64_t>(pixels, std::numeric_limits<int>::max()));
  };
  return {side(width), side(height)};
}

cv::Size JpegSize(std::string_view bytes) {
  constexpr std::size_t kFrameHeader = 9;
  for (std::size_t at = 2; at + kFrameHeader <= bytes.size();) {
    const std::int64_t marker = BigAt(bytes, at + 1, 1);
    const bool starts_segment = bytes[at] == '\xFF' && marker > 0x01 && marker < 0xFF;
    const bool is_table = marker == 0xC4 || marker == 0xC8 || marker == 0xCC;  // among the headers of frames
    const bool has_length = marker < 0xD0 || marker > 0xD9;                    // not a restart, start or end
    if (!starts_segment) {  // decoders look for the next one
      ++at;
    } else if (marker >= 0xC0 && marker <= 0xCF && !is_table) {
      return Pixels(BigAt(bytes, at + 7, 2), BigAt(bytes, at + 5, 2));
    } else {
      at += 2 + (has_length ? static_cast<std::size_t>(BigAt(bytes, at + 2, 2)) : 0);
    }
  }
  return {};
}

cv::Size BmpSize(std::string_view bytes) {
  if (LittleAt(bytes, 14, 4) == 12) {  // OS/2's header
    return Pixels(LittleAt(bytes, 18, 2), LittleAt(bytes, 20, 2));
  }
  const auto side = [&](std::size_t at) {  // negative heights: rows from the top down
    return std::abs(std::int64_t{static_cast<std::int32_t>(LittleAt(bytes, at, 4))});
  };
  return Pixels(side(18), side(22));
}

// A portable bit, grey or pixel map: the magic number, comments, the width and the height in decimal digits.
cv::Size PnmSize(std::string_view bytes) {
  std::size_t at = 2;
  const auto number = [&] {
    while (at < bytes.size() && (bytes[at] == '#' || std::isspace(static_cast<unsigned char>(bytes[at])))) {
      at = bytes[at] == '#' ? std::min(bytes.find('\n', at), bytes.size()) : at + 1;
    }
    std::int64_t value = 0;
    for (; at < bytes.size() && std::isdigit(static_cast<unsigned char>(bytes[at])); ++at) {
      value = std::min<std::int64_t>(10 * value + (bytes[at] - '0'), std::numeric_limits<int>::max());
    }
    return value;
  };
  const std::int64_t width = number();
  return Pixels(width, number());
}

cv::Size TiffSize(std::string_view bytes, ByteOrder order) {
  enum Tag : std::int64_t { kWidth = 256, kHeight = 257, kTileWidth = 322, kTileHeight = 323 };
  constexpr std::size_t kEntryBytes = 12;
  const auto first = static_cast<std::size_t>(NumberAt(bytes, 4, 4, order));
  std::int64_t width = 0;
  std::int64_t height = 0;
  for (std::int64_t i = NumberAt(bytes, first, 2, order); i > 0; --i) {
    const std::size_t entry = first + 2 + static_cast<std::size_t>(i - 1) * kEntryBytes;
    const std::size_t value_bytes = NumberAt(bytes, entry + 2, 2, order) == 3 ? 2 : 4;
    const std::int64_t value = NumberAt(bytes, entry + 8, value_bytes, order);
    switch (NumberAt(bytes, entry, 2, order)) {
      case kWidth:
      case kTileWidth:
        width = std::max(width, value);
        break;
      case kHeight:
      case kTileHeight:
        height = std::max(height, value);
        break;
      default:
        break;
    }
  }
  return Pixels(width, height);
}

cv::Size WebpSize(std::string_view bytes) {
  const std::string_view chunk = bytes.substr(std::min<std::size_t>(12, bytes.size()), 4);
  constexpr std::int64_t kSide = 0x3FFF;  // 14 bits
  if (chunk == "VP8X") {
    return Pixels(LittleAt(bytes, 24, 3) + 1, LittleAt(bytes, 27, 3) + 1);
  }
  if (chunk == "VP8L") {
    const std::int64_t sides = LittleAt(bytes, 21, 4);
    return Pixels((sides & kSide) + 1, ((sides >> 14) & kSide) + 1);
  }
  return chunk == "VP8 " ? Pixels(LittleAt(bytes, 26, 2) & kSide, LittleAt(bytes, 28, 2) & kSide)
                         : cv::Size();
}

cv::Size AnySize(std::string_view bytes) {
  using namespace std::string_view_literals;
  if (bytes.starts_with("\x89PNG")) {
    return Pixels(BigAt(bytes, 16, 4), BigAt(bytes, 20, 4));
  }
  if (bytes.starts_with("\xFF\xD8")) {
    return JpegSize(bytes);
  }
  if (bytes.starts_with("BM")) {
    return BmpSize(bytes);
  }
  if (bytes.size() > 2 && bytes[0] == 'P' && bytes[1] >= '1' && bytes[1] <= '6') {
    return PnmSize(bytes);
  }
  if (bytes.starts_with("II*\0"sv)) {
    return TiffSize(bytes, ByteOrder::kLittleEndian);
  }
  if (bytes.starts_with("MM\0*"sv)) {
    return TiffSize(bytes, ByteOrder::kBigEndian);
  }
  return bytes.starts_with("RIFF") && bytes.substr(0, 12).ends_with("WEBP") ? WebpSize(bytes) : cv::Size();
}

}  // namespace

std::optional<cv::Size> SizeInHeader(std::string_view bytes) {
  const cv::Size size = AnySize(bytes);
  return size.empty() ? std::nullopt : std::optional(size);
}

bool IsTooLarge(const cv::Size& size) {
  return std::max(size.width, size.height) > kMaxImageSide ||
         std::int64_t{size.width} * size.height > kMaxImagePixels;
}

DecodedImage DecodeImage(std::string_view bytes, int flags) {
  const std::optional<cv::Size> size = SizeInHeader(bytes);
  if (!size) {
    return {{}, "is no readable image"};
  }
  if (IsTooLarge(*size)) {
    return {{},
            fmt::format("claims {}x{} pixels, expected at most {} a side and {} in all", size->width,
                        size->height, kMaxImageSide, kMaxImagePixels)};
  }
  try {
    const std::vector<unsigned char> copy(bytes.begin(), bytes.end());  // OpenCV's decoder takes no view
    DecodedImage decoded{cv::imdecode(copy, flags), ""};
    decoded.problem = decoded.pixels.empty() ? "is no readable image" : "";
    return decoded;
  } catch (const cv::Exception&) {  // pixels that OpenCV's decoder refuses
    return {{}, "is no readable image"};
  }
}

}  // namespace sqslam
