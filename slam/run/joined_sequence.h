#pragma once

#include <filesystem>

#include "slam/geometry/camera.h"
#include "slam/snapshot/kept_map.h"

namespace sqslam {

// Lists the images of a map made from two sequences in RESULT/sequence (rgb.txt and camera.yaml), with the
// frame numbers and times of the map, so that a frame's image is found as in any other sequence. `camera`: of
// the map. Returns that folder. If both are the same sequence with the same numbers, writes nothing and
// returns `first`; if one is a video or missing, returns an empty path: better no image than a wrong one.
std::filesystem::path WriteJoinedSequence(const std::filesystem::path& result,
                                          const std::filesystem::path& first,
                                          const std::filesystem::path& second, const AddedFrames& added,
                                          const Camera& camera);

}  // namespace sqslam
