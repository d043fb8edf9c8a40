#pragma once

#include <filesystem>
#include <optional>

namespace sqslam {

inline constexpr double kFilmDiagonal = 43.2666;  // mm, of the 36 x 24 of 35 mm film

// The focal length that a photograph's EXIF gives for a 35 mm film of the same field of view, mm: the tag
// FocalLengthIn35mmFilm, else the focal length itself with the sensor's resolution (FocalPlaneXResolution).
// Empty where the file has neither (screenshots, videos, pictures sent by messengers).
std::optional<double> FocalLength35mm(const std::filesystem::path& image);

}  // namespace sqslam
