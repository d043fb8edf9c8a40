#include "slam/run/attempt_all.h"

#include <exception>

namespace sqslam::app {

void AttemptAll(const std::vector<std::function<void()>>& steps) {
  std::exception_ptr failure;
  for (const auto& step : steps) {
    try {
      step();
    } catch (...) {
      failure = failure ? failure : std::current_exception();
    }
  }
  if (failure) {
    std::rethrow_exception(failure);
  }
}

}  // namespace sqslam::app
