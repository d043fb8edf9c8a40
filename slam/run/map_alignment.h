#pragma once

#include <filesystem>

#include "slam/geometry/rigid3.h"

namespace sqslam {

// Returns the similarity that transforms the map of the second result into that of the first, both in metres
// where a result has a scale. Maps that share keyframes (one extends the other or was merged from it) are
// aligned by these, others by what both show, as MergeMaps does. Throws InputError if a result has no usable
// map, NoMapError if they show no common place.
Sim3d AlignMaps(const std::filesystem::path& first, const std::filesystem::path& second);

}  // namespace sqslam
