#pragma once

#include <cstddef>
#include <cstdint>

namespace sqslam {

// Sizes beyond which an input is refused by name. They lie far above what the program is for and far below
// what would take all memory or run for hours.

// Sides of an image in pixels: below, no corner has a neighbourhood; above, one frame takes a gigabyte.
inline constexpr int kMinImageSide = 16;
inline constexpr int kMaxImageSide = 16384;

// Bytes of a label or a name: pictures break lines of text at every word, and a class has one word or two.
inline constexpr std::size_t kMaxLabelBytes = 200;

// Bytes of a text, JSON or YAML file, or of a cloud: it is read whole.
inline constexpr std::uintmax_t kMaxFileBytes = std::uintmax_t{2} << 30;

// Distance from the origin of anything in a recording, and half size of an object, in map units.
inline constexpr double kMaxMapUnits = 1e9;

}  // namespace sqslam
