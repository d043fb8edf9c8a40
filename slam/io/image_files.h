#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
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

// The images of a folder without depth images, in numeric order.
std::vector<std::filesystem::path> ListColorImages(const std::filesystem::path& folder);

}  // namespace sqslam
