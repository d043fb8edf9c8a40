#pragma once

#include <cstddef>
#include <cstdint>

namespace sqslam {

// Limits beyond which an input is refused: far above any real input, far below inputs that would take all
// memory or run for hours.

// Sides of an image in pixels: below, corners have no neighbourhood; above, one frame takes a gigabyte.
inline constexpr int kMinImageSide = 16;
inline constexpr int kMaxImageSide = 16384;

// Pixels of an image: a decoder may need eight bytes for each, beside three of the result.
inline constexpr std::int64_t kMaxImagePixels = std::int64_t{1} << 26;

// Bytes of a label or a name: a class has one or two words, and pictures break lines at words only.
inline constexpr std::size_t kMaxLabelBytes = 200;

// Bytes of a text, JSON or YAML file or of a point cloud, which are read whole.
inline constexpr std::uintmax_t kMaxFileBytes = std::uintmax_t{2} << 30;

// Bytes of one state of a map in a recording, uncompressed: a point takes 27.
inline constexpr std::uint64_t kMaxSnapshotBytes = std::uint64_t{256} << 20;

// Objects of one state of a map: placing names in pictures compares each pair.
inline constexpr std::size_t kMaxObjects = 20000;

// Distance from the origin of anything in a recording and of a camera that looks at it, and half size of an
// object, in map units.
inline constexpr double kMaxMapUnits = 1e9;

// Metres of a map unit, or map units of a metre: lengths of either kind are then finite also as floats.
inline constexpr double kMaxMetresPerUnit = 1e9;

// Magnitude of a JSON number that is not a 64-bit integer: the largest value of the smallest type read.
inline constexpr double kMaxJsonReal = 2147483647.0;

// Nesting of lists and objects in a JSON file: copying a value takes stack for each level.
inline constexpr int kMaxJsonDepth = 100;

}  // namespace sqslam
