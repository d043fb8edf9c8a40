#pragma once

#include <functional>
#include <vector>

namespace sqslam::app {

// Runs every step even if one fails, so that a full disk or a missing display costs no more than it must; the
// first failure is thrown at the end.
void AttemptAll(const std::vector<std::function<void()>>& steps);

}  // namespace sqslam::app
