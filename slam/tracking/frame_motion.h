#pragma once

#include <cstdint>

#include "slam/geometry/rigid3.h"

namespace sqslam {

// The camera's motion from one tracked frame to the next.
struct FrameMotion {
  Rigid3d T_current_last;
  std::int64_t frames =
      1;  // frames of the camera from the one to the other; more than one where some are left out

  // The motion at constant velocity over another number of frames.
  Rigid3d Across(std::int64_t other_frames) const {
    if (other_frames == frames) {
      return T_current_last;
    }
    const double share = static_cast<double>(other_frames) / static_cast<double>(frames);
    return {Eigen::Quaterniond::Identity().slerp(share, T_current_last.rotation),
            share * T_current_last.translation};
  }
};

}  // namespace sqslam
