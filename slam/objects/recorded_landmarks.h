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

// Pose of a frame (T_map_camera) by its time; empty if there is none.
using PoseAtTime = std::function<std::optional<Rigid3d>(double timestamp)>;

// Restores the refined landmarks of a finished run from its recording: the boxes of the recorded frames, each
// frame once, and as inliers the points of `map`, with their indices as ids. Lines in the images are not
// recorded.
std::map<int, Landmark> RecordedLandmarks(const RecordingReader& recording, const MapSnapshot& map,
                                          const PoseAtTime& T_map_camera, const SupportSurfaces& supports,
                                          const ObjectOptions& options);

// Makes the map points for which `is_own` is true (by index) the inliers of the landmark, as seen in its
// boxes.
void SetPoints(const MapSnapshot& map, Landmark& landmark, const std::function<bool(std::size_t)>& is_own);

}  // namespace sqslam
