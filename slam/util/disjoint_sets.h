#pragma once

#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace sqslam {

// Union-find over the numbers from 0 to `count` - 1, with path halving.
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t count) : parents_(count) {
    std::iota(parents_.begin(), parents_.end(), std::int32_t{0});
  }

  // Returns the number that stands for the set of `i`.
  std::int32_t Root(std::int32_t i) {
    while (Parent(i) != i) {
      i = Parent(i) = Parent(Parent(i));
    }
    return i;
  }
  // Joins both sets; the root of `b` becomes their root.
  void Join(std::int32_t a, std::int32_t b) { Parent(Root(a)) = Root(b); }

 private:
  std::int32_t& Parent(std::int32_t i) { return parents_[static_cast<std::size_t>(i)]; }

  std::vector<std::int32_t> parents_;
};

}  // namespace sqslam
