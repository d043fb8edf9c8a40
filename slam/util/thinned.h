#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace sqslam {

// Returns the smallest step through `count` items that takes at most `most` (>= 1) of them.
constexpr std::size_t StepThrough(std::size_t count, std::size_t most) {
  return std::max<std::size_t>(1, (count + most - 1) / most);
}

// Returns every `step`-th (>= 1) of the items, from the first one.
template <typename Item>
std::vector<Item> EveryNth(const std::vector<Item>& items, std::size_t step) {
  std::vector<Item> taken;
  taken.reserve((items.size() + step - 1) / step);
  for (std::size_t i = 0; i < items.size(); i += step) {
    taken.push_back(items[i]);
  }
  return taken;
}

// Returns at most `most` (>= 1) of the items, at even steps from the first one.
template <typename Item>
std::vector<Item> Thinned(const std::vector<Item>& items, std::size_t most) {
  return EveryNth(items, StepThrough(items.size(), most));
}

}  // namespace sqslam
