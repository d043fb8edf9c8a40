#pragma once

#include "slam/objects/joint_refinement.h"
#include "slam/objects/landmark_geometry.h"
#include "synthetic_desk.h"

namespace sqslam::testing {

inline RefinementInput InputOf(const SyntheticDesk& desk, const PosedSuperquadric& truth) {
  RefinementInput input;
  input.camera = desk.Camera();
  for (int frame = 0; frame < SyntheticDesk::kFrames; frame += 6) {
    const auto box = ProjectToBox(truth, desk.Pose(frame), desk.Camera());
    input.views.push_back({desk.Pose(frame), *box, {true, true, true, true}});
  }
  return input;
}

inline double Bottom(const PosedSuperquadric& s) {
  return s.T_map_object.translation.z() - s.shape.half_size.z();
}

}  // namespace sqslam::testing
