#pragma once

#include <string>

#include "slam/objects/landmark.h"

namespace sqslam::testing {

constexpr int kHours = 200000;  // frames

inline ObjectObservation ObservationOf(const std::string& label, const Box2d& box, std::int64_t frame_index) {
  ObjectObservation observation;
  observation.frame_index = frame_index;
  observation.detection = {label, 0.5, box};
  return observation;
}

// Returns a cup with boxes in `frames` frames, `stride` apart.
inline Landmark SeenAt(double x, int frames, int stride = 1) {
  Landmark landmark;
  for (int i = 0; i < frames; ++i) {
    landmark.Add(ObservationOf("cup", {x, 100.0, 40.0, 50.0}, 1 + i * stride));
  }
  return landmark;
}

}  // namespace sqslam::testing
