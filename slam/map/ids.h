#pragma once

#include <cstdint>

namespace sqslam {

using KeyframeId = std::int64_t;
using PointId = std::int64_t;
inline constexpr PointId kNoPoint = -1;
inline constexpr KeyframeId kNoKeyframe = -1;

}  // namespace sqslam
