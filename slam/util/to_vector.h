#pragma once

#include <functional>
#include <ranges>
#include <type_traits>
#include <utility>
#include <vector>

namespace sqslam {

// Returns the items of a range through `projection`, a function or a member, as std::ranges::to of C++23.
template <std::ranges::input_range Range, typename Projection = std::identity>
auto ToVector(Range&& range, Projection projection = {}) {
  std::vector<std::decay_t<std::invoke_result_t<Projection&, std::ranges::range_reference_t<Range>>>> items;
  if constexpr (std::ranges::sized_range<Range>) {
    items.reserve(std::ranges::size(range));
  }
  for (auto&& item : range) {
    items.push_back(std::invoke(projection, std::forward<decltype(item)>(item)));
  }
  return items;
}

}  // namespace sqslam
