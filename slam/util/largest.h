#pragma once

#include <algorithm>
#include <functional>

namespace sqslam {

// Returns the largest value of the items, or `least` if none is larger.
template <typename Value, typename Projection>
Value Largest(const auto& items, Value least, const Projection& value) {
  for (const auto& item : items) {
    least = std::max<Value>(least, std::invoke(value, item));
  }
  return least;
}

}  // namespace sqslam
