#pragma once

#include <cstdint>
#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <regex>
#include <string>
#include <string_view>
#include <vector>

#include "slam/util/image_decoding.h"

namespace sqslam {

// Returns true for a name that begins with a dot, such as the ._000.jpg of macOS: never data.
bool IsHidden(const std::filesystem::path& path);

// Returns true for the extensions .png, .jpg, .jpeg, .bmp, .pgm, .ppm, .tif, .tiff or .webp, in any case.
bool IsImage(const std::filesystem::path& path);

// Returns true if the name before the extension ends in -depth, .depth or _depth, as depth images of RGB-D
// datasets do.
bool IsDepthImage(const std::filesystem::path& path);

// Orders names with runs of digits as numbers: "2.png" before "10.png". Names that differ only in leading
// zeros are ordered by their bytes, which makes the order total.
bool NumericLess(std::string_view a, std::string_view b);

// Returns the last run of digits of a name: 12 for "00012-color.png" and "scene_00_0012.png".
std::optional<std::int64_t> LastNumber(std::string_view name);

// Lists the files of a folder whose names match, in numeric order, without hidden ones.
std::vector<std::filesystem::path> FilesLike(const std::filesystem::path& folder, const std::regex& name);

// Returns the name with '#' for each run of digits, in lower case: equal for the images of one camera.
std::string NamePattern(const std::filesystem::path& path);

// Lists the images of a folder without depth images, in numeric order.
std::vector<std::filesystem::path> ListColorImages(const std::filesystem::path& folder);

// Size to which images are resized before use.
struct ImageResize {
  int width = 0;       // pixels; 0: by the scale
  int height = 0;      // pixels; 0: by the width and the image's aspect ratio
  double scale = 1.0;  // used if there is no width

  bool Changes() const { return width > 0 || scale != 1.0; }
  // Throws UsageError if a side becomes too small or too large to be tracked.
  cv::Size Of(cv::Size image) const;
};

// Parses "640", "640,480" (pixels) or "0.5" (a factor, at most 1). Throws UsageError for anything else.
ImageResize ParseImageResize(const std::string& text);

// Returns the image in another size, with averaged pixels if it shrinks; the image itself if it has that size
// or `size` is empty.
cv::Mat Resized(const cv::Mat& image, cv::Size size);

struct ImageFile {
  std::string bytes;
  std::string problem;  // empty if there are bytes, else the rest of a sentence: "is empty"
};

// Reads an image file without decoding it. Only a regular file of at most kMaxFileBytes is read: a pipe would
// block, and a device may never end.
ImageFile ReadImageFile(const std::filesystem::path& path);

// The values that become black and white where an image has more than 8 bits.
struct ValueRange {
  double black = 0.0;
  double white = 65535.0;

  // Returns true if a half of 16 bits is used: the upper 8 of them show everything then.
  bool IsWide() const { return white - black >= 0.5 * 65535.0; }
};

// Returns one range for images of more than 8 bits, from some of them: cameras of 10 to 14 bits, and thermal
// ones, use a small part of 16 bits. Returns nothing if the first one that can be read has 8 bits.
std::optional<ValueRange> FindValueRange(const std::vector<std::filesystem::path>& images);

// An image as people see it, and its way to a frame.
struct ShownImage {
  DecodedImage decoded;   // half the size if frames are smaller still: decodes in half of the time
  cv::Size size = {};     // px, of the image in the file
  int quarter_turns = 0;  // to the frames (QuarterTurnsTo)
};

// Decodes the bytes of an image file for a frame of this size with OpenCV's flag, cv::IMREAD_COLOR or
// cv::IMREAD_GRAYSCALE, to 8 bits. `range`: of images with more bits; without it, the image's own.
ShownImage DecodeForFrame(const std::string& bytes, cv::Size frame, cv::ImreadModes flag,
                          const std::optional<ValueRange>& range = {});

// Throws InputError that begins with the path if a side is too short or too long, or the image too large.
void CheckImageSides(const std::filesystem::path& path, const cv::Size& size);

// Reads an image file as DecodeImage() (util/image_decoding.h) does; empty if it cannot be read.
cv::Mat ReadImage(const std::filesystem::path& path, int flags);

// Reads an image as a frame of this size: turned if the other side is longer (QuarterTurnsTo), and resized.
// Empty if it cannot be read. `range`: see DecodeForFrame().
cv::Mat ReadImageInSize(const std::string& path, cv::Size size, cv::ImreadModes flag,
                        const std::optional<ValueRange>& range = {});

// Returns the bytes of a file of this extension, with OpenCV's parameters.
std::string EncodedImage(const std::string& extension, const cv::Mat& image,
                         const std::vector<int>& parameters = {});

}  // namespace sqslam
