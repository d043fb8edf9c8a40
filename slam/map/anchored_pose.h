#pragma once

#include "slam/geometry/rigid3.h"
#include "slam/map/ids.h"

namespace sqslam {

// Pose of a camera in a map whose unit of length differs between keyframes: closing a loop or merging maps
// rescales keyframes one by one. `scale` is the present length of one unit of the time when the keyframe was
// made.
struct ScaledPose {
  Rigid3d T_camera_map;
  double scale = 1.0;
};

// Pose of a frame relative to a keyframe: stays valid when the map is optimised, moved, rotated or rescaled.
struct AnchoredPose {
  KeyframeId reference = kNoKeyframe;
  Rigid3d T_camera_reference;
  double scale = 1.0;  // scale of the reference at the time of writing

  static void VisitState(auto& self, auto&& visit) {
    visit(self.reference, self.T_camera_reference, self.scale);
  }
};

// Returns T_camera_map of an anchored frame from the reference's present pose.
inline ScaledPose Resolve(const AnchoredPose& anchor, const ScaledPose& reference) {
  Rigid3d T_camera_reference = anchor.T_camera_reference;
  T_camera_reference.translation *= reference.scale / anchor.scale;
  return {T_camera_reference * reference.T_camera_map, reference.scale};
}

}  // namespace sqslam
