#pragma once

#include <map>
#include <optional>
#include <vector>

#include "slam/geometry/rigid3.h"
#include "slam/map/ids.h"

namespace sqslam {

// Pose of a camera in a map whose unit of length differs between keyframes: closing a loop or merging maps
// rescales keyframes one by one. `scale` is the length today of what was one unit when the keyframe was
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

// Pose of a keyframe that the map no longer holds.
struct RemovedKeyframe {
  AnchoredPose pose;  // relative to its parent, which may have been removed later
  double scale = 1.0;

  static void VisitState(auto& self, auto&& visit) { visit(self.pose, self.scale); }
};

using RemovedKeyframes = std::map<KeyframeId, RemovedKeyframe>;

// Returns the pose of a present or removed keyframe. `present(id)`: the pose of a present one, else nullopt.
// Throws std::out_of_range if the keyframe is neither.
ScaledPose PoseOf(const RemovedKeyframes& removed, KeyframeId id, const auto& present) {
  std::vector<const RemovedKeyframe*> way;  // from the keyframe to its nearest present ancestor
  std::optional<ScaledPose> pose = present(id);
  while (!pose) {
    way.push_back(&removed.at(id));
    id = way.back()->pose.reference;
    pose = present(id);
  }
  for (; !way.empty(); way.pop_back()) {
    const double scale = way.back()->scale * pose->scale / way.back()->pose.scale;
    pose = {Resolve(way.back()->pose, *pose).T_camera_map, scale};
  }
  return *pose;
}

}  // namespace sqslam
