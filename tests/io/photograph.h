#pragma once

#include <cstdint>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "tests/io/temporary_folder.h"

namespace sqslam {

// The lowest byte first.
inline std::string Little(std::uint32_t value, int bytes) {
  std::string text;
  for (int i = 0; i < bytes; ++i) {
    text += static_cast<char>((value >> (8 * i)) & 0xFF);
  }
  return text;
}

// Data that a camera writes about a photograph.
struct Exif {
  std::uint32_t orientation = 1;  // of the tag: 6 is shown turned clockwise by 90 degrees
  std::uint32_t focal_mm = 0;     // for 35 mm film; 0: unknown
};

// Writes a JPEG file with these pixels, as the sensor has them.
inline std::filesystem::path WritePhotograph(const TemporaryFolder& folder, const std::string& name,
                                             const cv::Mat& pixels, const Exif& exif) {
  constexpr std::uint32_t kShort = 3;
  constexpr std::uint32_t kLong = 4;
  const auto entry = [](std::uint32_t tag, std::uint32_t type, std::uint32_t value) {
    return Little(tag, 2) + Little(type, 2) + Little(1, 4) + Little(value, 4);
  };
  const std::string first = Little(2, 2) + entry(0x0112, kShort, exif.orientation) +
                            entry(0x8769, kLong, 38) + Little(0, 4);  // where the second part is
  const std::string second = exif.focal_mm > 0
                                 ? Little(1, 2) + entry(0xA405, kShort, exif.focal_mm) + Little(0, 4)
                                 : Little(0, 2) + Little(0, 4);
  const std::string body =
      std::string("Exif\0\0", 6) + std::string("II*\0", 4) + Little(8, 4) + first + second;
  const std::size_t length = body.size() + 2;
  std::vector<unsigned char> jpeg;
  cv::imencode(".jpg", pixels, jpeg, {cv::IMWRITE_JPEG_QUALITY, 98});
  std::string bytes(jpeg.begin(), jpeg.end());
  bytes.insert(
      2, std::string("\xFF\xE1") + static_cast<char>(length >> 8) + static_cast<char>(length & 0xFF) + body);
  return folder.Write(name, bytes);
}

}  // namespace sqslam
