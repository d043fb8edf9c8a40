#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace sqslam {

// Returns the smallest step through `count` items that takes at most `most` (>= 1) of them.
constexpr std::size_t StepThrough(std::size_t count, std::size_t most) {
  return std::max<std::size_t>(1, (count + most - 1) / most);
}

// Returns at most `most` (>= 1) of the items, at even steps from the first one.
template <typename Item>
std::vector<Item> Thinned(const std::vector<Item>& items, std::size_t most) {
  const std::size_t step = StepThrough(items.size(), most);
  std::vector<Item> thinned;
  thinned.reserve((items.size() + step - 1) / step);
  for (std::size_t i = 0; i < items.size(); i += step) {
    thinned.push_back(items[i]);
  }
  return thinned;
}

}  // namespace sqslam
