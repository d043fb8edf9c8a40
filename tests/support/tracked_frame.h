#pragma once

#include <utility>

#include "slam/tracking/pose_tracker.h"

namespace sqslam::testing {

// A frame with features only.
inline TrackedFrame NewFrame(FrameFeaturesPtr features, std::int64_t index = 0) {
  TrackedFrame frame;
  frame.index = index;
  frame.timestamp = static_cast<double>(index) / 30.0;
  frame.features = std::move(features);
  frame.ClearPoints();
  return frame;
}

// A keyframe in the state of a frame that has just been tracked.
inline TrackedFrame AsTracked(const Map& map, KeyframeId id) {
  const Keyframe& keyframe = map.At(id);
  TrackedFrame frame = NewFrame(keyframe.features, keyframe.frame_index);
  frame.points = keyframe.points;
  frame.T_camera_map = keyframe.T_camera_map;
  frame.anchor = {id, {}, keyframe.scale};
  return frame;
}

}  // namespace sqslam::testing
