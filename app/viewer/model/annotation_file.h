#pragma once

#include <filesystem>

#include "app/viewer/model/annotation.h"
#include "slam/geometry/rigid3.h"

namespace sqslam::viewer {

// objects_gt.json: {id, label, primitive, center, yaw, T_world_object (4x4, row-major), half_size, shape} for
// each solid; what else a file said, of an object or of itself, is written back as it was.
//
// The annotation may live in another frame than the file: drawn on a map, it is in map units and the map's
// frame, while the ground truth is in metres and the world's. S_file_annotation leads from one to the other.
// `yaw` of the file is about the file's z axis.

// Throws InputError that names file and object.
Annotation ReadAnnotation(const std::filesystem::path& path, const Sim3d& S_file_annotation = {});
void WriteAnnotation(const std::filesystem::path& path, const Annotation& annotation,
                     const Sim3d& S_file_annotation = {});

// S_world_map of a result against the ground truth's camera poses of its sequence, by the trajectories.
// Throws InputError where there is no ground truth, or the two do not determine it.
Sim3d AlignToGroundTruth(const std::filesystem::path& result, const std::filesystem::path& sequence);

}  // namespace sqslam::viewer
