#pragma once

#include <cstdint>
#include <filesystem>
#include <opencv2/core.hpp>
#include <optional>
#include <regex>
#include <string>
#include <string_view>
#include <vector>

namespace sqslam {

// True for the extensions .png, .jpg, .jpeg, .bmp, .pgm, .ppm, .tif, .tiff or .webp, in any case.
bool IsImage(const std::filesystem::path& path);

// True where the name before the extension ends in -depth, .depth or _depth, as RGB-D datasets name their
// depth images.
bool IsDepthImage(const std::filesystem::path& path);

// Order of names in which runs of digits count as numbers: "2.png" before "10.png". Names that differ only in
// leading zeros are ordered by their bytes, so that the order is total.
bool NumericLess(std::string_view a, std::string_view b);

// The last run of digits of a name: 12 for "00012-color.png" and "scene_00_0012.png"; none without digits.
std::optional<std::int64_t> LastNumber(std::string_view name);

// The files of a folder whose names match, in numeric order.
std::vector<std::filesystem::path> FilesLike(const std::filesystem::path& folder, const std::regex& name);

// The images of a folder without depth images, in numeric order.
std::vector<std::filesystem::path> ListColorImages(const std::filesystem::path& folder);

// Size that images are brought to before they are used.
struct ImageResize {
  int width = 0;       // pixels; 0: by the scale
  int height = 0;      // pixels; 0: as the width and the image's proportions have it
  double scale = 1.0;  // used where there is no width

  bool Changes() const { return width > 0 || scale != 1.0; }
  // Throws UsageError where a side gets too small or too large to be tracked.
  cv::Size Of(cv::Size image) const;
};

// "640", "640,480" (pixels) or "0.5" (a factor, at most 1). Throws UsageError for anything else; empty: as
// they are.
ImageResize ParseImageResize(const std::string& text);

// The image in another size, averaged over the pixels that fall together; itself where it has that size or
// none is given.
cv::Mat Resized(const cv::Mat& image, cv::Size size);

// A file's image, read with OpenCV's flags (cv::IMREAD_COLOR, ...); empty where it cannot be read.
cv::Mat ReadImage(const std::filesystem::path& path, int flags);

// A file's image in this size, 8UC3; empty where it cannot be read.
cv::Mat ReadImageInSize(const std::string& path, cv::Size size);

}  // namespace sqslam
