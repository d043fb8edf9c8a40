#include "slam/tracking/frame_motion.h"

namespace sqslam {

Rigid3d FrameMotion::Across(std::int64_t other_frames) const {
  if (other_frames == frames) {
    return T_current_last;
  }
  const double share = static_cast<double>(other_frames) / static_cast<double>(frames);
  return {Eigen::Quaterniond::Identity().slerp(share, T_current_last.rotation),
          share * T_current_last.translation};
}

}  // namespace sqslam
