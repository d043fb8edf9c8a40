#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <optional>

#include "slam/objects/landmark.h"
#include "slam/objects/object_options.h"
#include "slam/objects/support.h"
#include "slam/snapshot/recording.h"

namespace sqslam {

// Pose of a frame (T_map_camera) by its time; empty where there is none.
using PoseAtTime = std::function<std::optional<Rigid3d>(double timestamp)>;

// The refined landmarks of a finished run as its recording tells of them: the boxes of the recorded frames,
// each frame's once, and the points of `map`, which are the landmarks' inliers and are named by their indices
// there. Lines of the images are not recorded.
std::map<int, Landmark> RecordedLandmarks(const RecordingReader& recording, const MapSnapshot& map,
                                          const PoseAtTime& T_map_camera, const SupportSurfaces& supports,
                                          const ObjectOptions& options);

// Makes those of the map's points (by index) the landmark's inliers, as seen in its boxes.
void SetPoints(const MapSnapshot& map, Landmark& landmark, const std::function<bool(std::size_t)>& is_own);

}  // namespace sqslam
