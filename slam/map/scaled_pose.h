#pragma once

#include "slam/geometry/rigid3.h"
#include "slam/map/ids.h"

namespace sqslam {

// Pose of a camera in a map whose unit of length may differ from place to place of its history: closing a
// loop or merging two maps changes the scale of keyframes one by one. `scale` is the length that now stands
// for one unit of the time when the keyframe was made.
struct ScaledPose {
  Rigid3d T_camera_map;
  double scale = 1.0;
};

// Pose of a frame relative to a keyframe: stays right when the map is optimised, moved, turned or rescaled.
struct AnchoredPose {
  KeyframeId reference = kNoKeyframe;
  Rigid3d T_camera_reference;
  double scale = 1.0;  // scale of the reference when this was written
};

// T_camera_map of an anchored frame, from the reference's present pose.
inline ScaledPose Resolve(const AnchoredPose& anchor, const ScaledPose& reference) {
  Rigid3d T_camera_reference = anchor.T_camera_reference;
  T_camera_reference.translation *= reference.scale / anchor.scale;
  return {T_camera_reference * reference.T_camera_map, reference.scale};
}

// The camera's pose after the map was moved: p_new = S_new_old * p_old.
inline Rigid3d MoveCamera(const Rigid3d& T_camera_map, const Sim3d& S_new_old) {
  const Eigen::Quaterniond rotation = (T_camera_map.rotation * S_new_old.rotation.conjugate()).normalized();
  return {rotation, S_new_old.scale * T_camera_map.translation - rotation * S_new_old.translation};
}

}  // namespace sqslam
