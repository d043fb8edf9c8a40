#include "slam/features/quadtree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <queue>
#include <span>
#include <utility>

namespace sqslam {
namespace {

// Part of the area, with the range of its corners in Quadtree::order_.
struct Leaf {
  cv::Rect2f area;
  std::size_t begin = 0;
  std::size_t end = 0;
};

class Quadtree {
 public:
  Quadtree(const std::vector<cv::KeyPoint>& corners, cv::Size area);
  void Split(std::size_t count);
  std::vector<cv::KeyPoint> StrongestOfEach() const;

 private:
  // Adds a leaf for each group of the corners of [begin, end) that is not empty. `group_of` maps a corner to
  // the index of its area. Corners keep their order within a group.
  template <typename GroupOf>
  void AddLeaves(std::size_t begin, std::size_t end, std::span<const cv::Rect2f> areas, GroupOf&& group_of);
  void SplitLeaf(const Leaf& leaf);
  int Strongest(const Leaf& leaf) const;

  // The leaf with the most corners is split first; ties go to the older leaf, so that the result is
  // repeatable.
  struct Later {
    bool operator()(const std::pair<std::size_t, std::size_t>& a,
                    const std::pair<std::size_t, std::size_t>& b) const {
      return a.first != b.first ? a.first < b.first : a.second > b.second;
    }
  };

  const std::vector<cv::KeyPoint>& corners_;
  std::vector<int> order_;  // indices of corners_, those of one leaf next to each other
  std::vector<int> scratch_;
  std::vector<int> groups_;
  std::vector<std::size_t> starts_;  // beginnings of the groups in order_
  std::vector<Leaf> leaves_;         // empty ones have been split
  std::size_t filled_ = 0;
  std::priority_queue<std::pair<std::size_t, std::size_t>, std::vector<std::pair<std::size_t, std::size_t>>,
                      Later>
      open_;
};

Quadtree::Quadtree(const std::vector<cv::KeyPoint>& corners, cv::Size area)
    : corners_(corners), order_(corners.size()) {
  std::iota(order_.begin(), order_.end(), 0);
  const int columns =
      std::max(1, static_cast<int>(std::lround(static_cast<double>(area.width) / area.height)));
  const float width = static_cast<float>(area.width) / static_cast<float>(columns);
  std::vector<cv::Rect2f> areas;
  for (int i = 0; i < columns; ++i) {
    areas.emplace_back(static_cast<float>(i) * width, 0.0F, width, static_cast<float>(area.height));
  }
  AddLeaves(0, order_.size(), areas,
            [&](const cv::Point2f& p) { return std::min(columns - 1, static_cast<int>(p.x / width)); });
}

template <typename GroupOf>
void Quadtree::AddLeaves(std::size_t begin, std::size_t end, std::span<const cv::Rect2f> areas,
                         GroupOf&& group_of) {
  starts_.assign(areas.size() + 1, 0);
  scratch_.assign(order_.begin() + static_cast<std::ptrdiff_t>(begin),
                  order_.begin() + static_cast<std::ptrdiff_t>(end));
  groups_.resize(scratch_.size());
  for (std::size_t i = 0; i < scratch_.size(); ++i) {
    groups_[i] = group_of(corners_[static_cast<std::size_t>(scratch_[i])].pt);
    ++starts_[static_cast<std::size_t>(groups_[i]) + 1];
  }
  starts_[0] = begin;
  for (std::size_t i = 0; i < areas.size(); ++i) {
    starts_[i + 1] += starts_[i];
    if (starts_[i + 1] > starts_[i]) {
      ++filled_;
      leaves_.push_back({areas[i], starts_[i], starts_[i + 1]});
      if (starts_[i + 1] - starts_[i] > 1) {
        open_.emplace(starts_[i + 1] - starts_[i], leaves_.size() - 1);
      }
    }
  }
  for (std::size_t i = 0; i < scratch_.size(); ++i) {
    order_[starts_[static_cast<std::size_t>(groups_[i])]++] = scratch_[i];
  }
}

void Quadtree::SplitLeaf(const Leaf& leaf) {
  const float w = 0.5F * leaf.area.width;
  const float h = 0.5F * leaf.area.height;
  const cv::Point2f middle(leaf.area.x + w, leaf.area.y + h);
  const std::array<cv::Rect2f, 4> areas{{{leaf.area.x, leaf.area.y, w, h},
                                         {middle.x, leaf.area.y, w, h},
                                         {leaf.area.x, middle.y, w, h},
                                         {middle.x, middle.y, w, h}}};
  AddLeaves(leaf.begin, leaf.end, areas,
            [&](const cv::Point2f& p) { return (p.x >= middle.x ? 1 : 0) + (p.y >= middle.y ? 2 : 0); });
}

void Quadtree::Split(std::size_t count) {
  while (filled_ < count && !open_.empty()) {
    const std::size_t index = open_.top().second;
    open_.pop();
    const Leaf leaf = leaves_[index];
    if (leaf.area.width >= 1.0F) {  // else coinciding corners: their leaf stays as it is
      leaves_[index].end = leaf.begin;
      --filled_;
      SplitLeaf(leaf);
    }
  }
}

int Quadtree::Strongest(const Leaf& leaf) const {
  int strongest = order_[leaf.begin];
  for (std::size_t i = leaf.begin + 1; i < leaf.end; ++i) {
    if (corners_[static_cast<std::size_t>(order_[i])].response >
        corners_[static_cast<std::size_t>(strongest)].response) {
      strongest = order_[i];
    }
  }
  return strongest;
}

std::vector<cv::KeyPoint> Quadtree::StrongestOfEach() const {
  std::vector<cv::KeyPoint> kept;
  kept.reserve(filled_);
  for (const Leaf& leaf : leaves_) {
    if (leaf.begin < leaf.end) {
      kept.push_back(corners_[static_cast<std::size_t>(Strongest(leaf))]);
    }
  }
  return kept;
}

}  // namespace

std::vector<cv::KeyPoint> DistributeByQuadtree(const std::vector<cv::KeyPoint>& corners, cv::Size area,
                                               int count) {
  if (static_cast<int>(corners.size()) <= count) {
    return corners;
  }
  Quadtree tree(corners, area);
  tree.Split(static_cast<std::size_t>(count));
  return tree.StrongestOfEach();
}

}  // namespace sqslam
