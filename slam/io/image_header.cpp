#include "slam/io/image_header.h"

#include <libexif/exif-data.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <sstream>
#include <string>

#include "slam/io/image_files.h"

namespace sqslam {
namespace {

constexpr std::uint32_t kJpeg = 0xFFD8;  // first bytes
constexpr int kTurnOfPhones = 1;  // clockwise, from the sensor's landscape pixels to a portrait photograph

int Modulo4(int turns) { return ((turns % 4) + 4) % 4; }

struct UnrefExif {
  void operator()(ExifData* data) const { exif_data_unref(data); }
};

// Returns the next bytes of a file as a number, the most significant first; 0 at the end.
std::uint32_t BigEndian(std::istream& file, int bytes) {
  std::uint32_t number = 0;
  for (int i = 0; i < bytes; ++i) {
    const int next = file.get();
    number = (number << 8U) | (next < 0 ? 0U : static_cast<std::uint32_t>(next));
  }
  return number;
}

// Returns the clockwise quarter turns of an EXIF segment's orientation; 0 without one.
int ExifQuarterTurns(const std::string& segment) {
  constexpr std::array kTurns = {0, 0, 0, 2, 2, 3, 1, 1, 3};  // by orientation, mirrored or not
  const std::unique_ptr<ExifData, UnrefExif> data(exif_data_new_from_data(
      reinterpret_cast<const unsigned char*>(segment.data()), static_cast<unsigned int>(segment.size())));
  ExifEntry* const entry =
      data ? exif_content_get_entry(data->ifd[EXIF_IFD_0], EXIF_TAG_ORIENTATION) : nullptr;
  if (entry == nullptr || entry->format != EXIF_FORMAT_SHORT || entry->size < 2) {
    return 0;
  }
  const std::size_t orientation = exif_get_short(entry->data, exif_data_get_byte_order(data.get()));
  return orientation < kTurns.size() ? kTurns[orientation] : 0;
}

// Reads the segments of a JPEG file, behind its first two bytes, up to the one that holds the size.
std::optional<ImageHeader> ReadJpeg(std::istream& file) {
  constexpr std::uint32_t kApp1 = 0xFFE1;
  constexpr std::uint32_t kFirstFrame = 0xFFC0;  // to 0xFFCF, with the exceptions below
  constexpr std::array<std::uint32_t, 3> kNoFrames = {0xFFC4, 0xFFC8, 0xFFCC};  // tables
  ImageHeader header;
  while (file) {
    const std::uint32_t marker = BigEndian(file, 2);
    const std::uint32_t length = BigEndian(file, 2);
    if (marker < kFirstFrame || length < 2) {
      return std::nullopt;
    }
    if (marker <= kFirstFrame + 0xF && std::ranges::find(kNoFrames, marker) == kNoFrames.end()) {
      BigEndian(file, 1);  // bits of a sample
      const auto height = static_cast<int>(BigEndian(file, 2));
      const auto width = static_cast<int>(BigEndian(file, 2));
      header.size = Turned(cv::Size(width, height), header.quarter_turns);
      return file ? std::optional(header) : std::nullopt;
    }
    if (marker == kApp1 && header.quarter_turns == 0) {
      std::string segment(length - 2, '\0');
      file.read(segment.data(), std::ssize(segment));
      header.quarter_turns = ExifQuarterTurns(segment);
    } else {
      file.seekg(length - 2, std::ios::cur);
    }
  }
  return std::nullopt;
}

}  // namespace

std::optional<ImageHeader> JpegHeader(std::string_view bytes) {
  constexpr std::size_t kMaxBytes = std::size_t{1}
                                    << 20;  // previews and colour profiles come before the size
  std::istringstream file(std::string(bytes.substr(0, kMaxBytes)));
  return BigEndian(file, 2) == kJpeg ? ReadJpeg(file) : std::nullopt;
}

std::optional<ImageHeader> ReadImageHeader(const std::filesystem::path& path) {
  std::error_code none;
  if (!std::filesystem::is_regular_file(path, none)) {  // a pipe would block
    return std::nullopt;
  }
  std::ifstream file(path, std::ios::binary);
  const std::uint32_t start = BigEndian(file, 2);
  if (start == kJpeg) {
    return ReadJpeg(file);
  }
  if (start == 0x8950) {  // PNG: signature, length and name of the first chunk, then the size
    file.seekg(16);
    const auto width = static_cast<int>(BigEndian(file, 4));
    const auto height = static_cast<int>(BigEndian(file, 4));
    return file ? std::optional(ImageHeader{{width, height}}) : std::nullopt;
  }
  const cv::Mat image = ReadImage(path, cv::IMREAD_COLOR);
  return image.empty() ? std::nullopt : std::optional(ImageHeader{image.size()});
}

int QuarterTurnsTo(cv::Size frame, const ImageHeader& image) {
  const auto is_portrait = [](cv::Size size) { return size.height > size.width; };
  if (frame.width == frame.height || image.size.width == image.size.height ||
      is_portrait(frame) == is_portrait(image.size)) {
    return 0;
  }
  const int of_frame = is_portrait(frame) ? kTurnOfPhones : 0;  // from the sensor to the frame
  const int turns = Modulo4(of_frame - image.quarter_turns);
  return turns % 2 != 0 ? turns : is_portrait(frame) ? kTurnOfPhones : 4 - kTurnOfPhones;
}

cv::Mat Turned(const cv::Mat& image, int quarter_turns) {
  constexpr std::array<int, 3> kCodes = {cv::ROTATE_90_CLOCKWISE, cv::ROTATE_180,
                                         cv::ROTATE_90_COUNTERCLOCKWISE};
  const int turns = Modulo4(quarter_turns);
  if (turns == 0 || image.empty()) {
    return image;
  }
  cv::Mat turned;
  cv::rotate(image, turned, kCodes[static_cast<std::size_t>(turns - 1)]);
  return turned;
}

cv::Size Turned(cv::Size size, int quarter_turns) {
  return quarter_turns % 2 == 0 ? size : cv::Size(size.height, size.width);
}

Box2d Turned(const Box2d& box, cv::Size from, int quarter_turns, cv::Size to) {
  Box2d turned = box;
  for (int i = 0; i < Modulo4(quarter_turns); ++i) {  // (x, y) -> (height - y, x)
    turned = {from.height - turned.y - turned.height, turned.x, turned.height, turned.width};
    from = Turned(from, 1);
  }
  const double x = static_cast<double>(to.width) / from.width;
  const double y = static_cast<double>(to.height) / from.height;
  return {turned.x * x, turned.y * y, turned.width * x, turned.height * y};
}

}  // namespace sqslam
