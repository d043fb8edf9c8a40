#pragma once

#include <atomic>
#include <cstdint>

namespace sqslam {

using KeyframeId = std::int64_t;
using PointId = std::int64_t;
inline constexpr PointId kNoPoint = -1;
inline constexpr KeyframeId kNoKeyframe = -1;

// Gives out the ids of keyframes and map points. All submaps of a run share one, on both threads, so that ids
// stay unique, and stay the same when submaps are merged.
struct IdSource {
  std::atomic<KeyframeId> next_keyframe = 0;
  std::atomic<PointId> next_point = 0;
};

}  // namespace sqslam
