#pragma once

#include <atomic>
#include <cstdint>

namespace sqslam {

using KeyframeId = std::int64_t;
using PointId = std::int64_t;
inline constexpr PointId kNoPoint = -1;
inline constexpr KeyframeId kNoKeyframe = -1;

// Issues the ids of keyframes and map points. All submaps of a run share one, on both threads: ids are unique
// and don't change when submaps are merged.
struct IdSource {
  std::atomic<KeyframeId> next_keyframe = 0;
  std::atomic<PointId> next_point = 0;
};

}  // namespace sqslam
