#pragma once

#include <filesystem>

#include "slam/geometry/camera.h"
#include "slam/snapshot/kept_map.h"

namespace sqslam {

// Lists the images of a map that is made of two sequences in RESULT/sequence, rgb.txt and camera.yaml, each
// frame with the number and the time that it has in the map, so that whoever looks for a frame's image finds
// it as for any other sequence. `camera`: of the map. Returns that folder. Writes nothing where the frames of
// the second are those of the first by number already, and returns the first; and where one of the two is a
// video or is not there, and returns an empty path: better no image than a wrong one.
std::filesystem::path WriteJoinedSequence(const std::filesystem::path& result,
                                          const std::filesystem::path& first,
                                          const std::filesystem::path& second, const AddedFrames& added,
                                          const Camera& camera);

}  // namespace sqslam
