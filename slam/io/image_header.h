#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <optional>
#include <string_view>

#include "slam/geometry/box2.h"

namespace sqslam {

// The size of an image file, and how the camera was held.
struct ImageHeader {
  cv::Size size;          // px, as shown: rotated as the EXIF orientation says, which every reader here does
  int quarter_turns = 0;  // clockwise, from the sensor's pixels to the shown ones

  bool operator==(const ImageHeader&) const = default;
};

// Reads the header of a JPEG file in memory; nothing for other formats.
std::optional<ImageHeader> JpegHeader(std::string_view bytes);

// Reads JPEG and PNG files without decoding them, others whole. Returns nothing if there is no image.
std::optional<ImageHeader> ReadImageHeader(const std::filesystem::path& path);

// Returns the clockwise quarter turns from a shown image to the frames of a sequence, whose size is `frame`:
// none if both are portrait, both landscape, or one is square. Otherwise the camera was held upright for one
// and on its side for the other, and the image is turned to the sensor's pixels, for which focal length and
// principal point hold. An image without EXIF counts as taken with the camera turned as phones are.
int QuarterTurnsTo(cv::Size frame, const ImageHeader& image);

// Returns the image turned clockwise; the image itself for 0.
cv::Mat Turned(const cv::Mat& image, int quarter_turns);

// Returns the size of images of this size after turning.
cv::Size Turned(cv::Size size, int quarter_turns);

// Returns the box of an image of size `from` that is turned clockwise, then resized to `to`.
Box2d Turned(const Box2d& box, cv::Size from, int quarter_turns, cv::Size to);

}  // namespace sqslam
