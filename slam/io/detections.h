#pragma once

#include <filesystem>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/geometry/detection.h"

namespace sqslam {

// Boxes of a whole sequence, as read: one list for each of the given frames.
//
// `path` is either boxes.txt (`timestamp label score x y w h [object_id [visible_fraction]]`) or a folder
// with one TIMESTAMP.txt a frame (`class x y w h score`, COCO class numbers from 0). frame_timestamps rise.
//
// Boxes are clipped to the image, those wholly outside dropped. Warns (spdlog), at most once per kind or
// label, of boxes outside, boxes whose timestamp is no frame's, and labels that no list knows. Throws
// InputError that names file and line for a broken line.
std::vector<std::vector<Detection>> ReadDetections(const std::filesystem::path& path, const Camera& camera,
                                                   const std::vector<double>& frame_timestamps);

}  // namespace sqslam
