#include "app/attempt_all.h"

#include <optional>
#include <string>

#include "slam/util/error.h"

namespace sqslam::app {

void AttemptAll(const std::vector<std::function<void()>>& steps) {
  std::optional<std::string> failure;
  for (const auto& step : steps) {
    try {
      step();
    } catch (const InputError& e) {
      failure = failure.value_or(e.what());
    }
  }
  if (failure) {
    throw InputError(*failure);
  }
}

}  // namespace sqslam::app
