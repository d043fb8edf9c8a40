#pragma once

#include <type_traits>
#include <utility>

namespace sqslam {

// Adds a number to every key of a map or set.
void ShiftKeys(auto& keys, auto shift) {
  std::remove_reference_t<decltype(keys)> raised;
  while (!keys.empty()) {
    auto node = keys.extract(keys.begin());
    if constexpr (requires { node.key(); }) {
      node.key() += shift;
    } else {
      node.value() += shift;
    }
    raised.insert(raised.end(), std::move(node));
  }
  keys = std::move(raised);
}

}  // namespace sqslam
