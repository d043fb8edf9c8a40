#pragma once

#include <vector>

#include "slam/geometry/camera.h"
#include "slam/map/map.h"
#include "slam/tracking/pose_tracker.h"

// Aligns keypoints of a map point by the images around them. A corner is detected in each image by itself,
// half a pixel off; aligned with each other they agree to a tenth (as the features of SVO, Forster et al.
// 2014).
namespace sqslam {

// Aligns the observations of a keyframe's map points that are not aligned yet, in all keyframes, each with
// the point's reference: the finest and most frontal of those that are aligned, or of all. Keypoints without
// patches stay.
void AlignObservations(Map& map, const Camera& camera, KeyframeId keyframe);

// Aligns the keypoints of a frame with the references of their points. `features`: of the frame.
void AlignMatches(const Map& map, const Camera& camera, const FrameFeatures& features,
                  const Rigid3d& T_camera_map, std::vector<FrameMatch>& matches);

}  // namespace sqslam
