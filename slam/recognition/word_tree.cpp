#include "slam/recognition/word_tree.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

namespace sqslam {

WordTree::WordTree(std::vector<std::uint8_t> child_counts, std::vector<DescriptorBits> centers)
    : child_counts_(std::move(child_counts)), centers_(std::move(centers)) {
  const std::size_t count = child_counts_.size();
  if (count == 0 || centers_.size() != count) {
    throw std::invalid_argument(fmt::format("{} nodes with {} centres", count, centers_.size()));
  }
  first_children_.resize(count);
  word_of_node_.resize(count);
  std::vector<int> levels(count, 0);
  std::size_t next = 1;  // the first node without a parent yet
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t children = child_counts_[i];
    if (i >= next) {
      throw std::invalid_argument(fmt::format("node {} is no node's child", i));
    }
    if (children > count - next) {
      throw std::invalid_argument(fmt::format("node {} has children beyond the last node", i));
    }
    first_children_[i] = static_cast<NodeId>(next);
    for (std::size_t child = next; child < next + children; ++child) {
      levels[child] = levels[i] + 1;
    }
    next += children;
    depth_ = std::max(depth_, levels[i]);
    if (children == 0) {
      word_of_node_[i] = static_cast<WordId>(words_++);
    }
  }
}

WordId WordTree::WordOf(const DescriptorBits& descriptor) const {
  std::size_t node = 0;
  while (child_counts_[node] > 0) {
    const std::size_t first = first_children_[node];
    const std::span<const DescriptorBits> children(centers_.data() + first, child_counts_[node]);
    node = first + static_cast<std::size_t>(FindNearest(children, descriptor).index);
  }
  return word_of_node_[node];
}

}  // namespace sqslam
