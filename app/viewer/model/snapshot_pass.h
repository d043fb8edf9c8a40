#pragma once

#include <functional>

namespace sqslam::viewer {

// Told after each snapshot of a pass over a recording; returns false to stop.
using PassProgress = std::function<bool(int done, int total)>;

}  // namespace sqslam::viewer
