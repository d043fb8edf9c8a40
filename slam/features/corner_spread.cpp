#include "slam/features/corner_spread.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <queue>

namespace sqslam {
namespace {

struct Leaf {
  cv::Rect2f area;
  std::vector<int> corners;
};

std::array<Leaf, 4> Split(const Leaf& leaf, const std::vector<cv::KeyPoint>& corners) {
  const float w = 0.5F * leaf.area.width;
  const float h = 0.5F * leaf.area.height;
  std::array<Leaf, 4> children;
  for (int i = 0; i < 4; ++i) {
    children[static_cast<std::size_t>(i)].area = {leaf.area.x + static_cast<float>(i % 2) * w,
                                                  leaf.area.y + static_cast<float>(i / 2) * h, w, h};
  }
  for (const int index : leaf.corners) {
    const cv::Point2f& p = corners[static_cast<std::size_t>(index)].pt;
    const int child = (p.x >= leaf.area.x + w ? 1 : 0) + (p.y >= leaf.area.y + h ? 2 : 0);
    children[static_cast<std::size_t>(child)].corners.push_back(index);
  }
  return children;
}

int Strongest(const Leaf& leaf, const std::vector<cv::KeyPoint>& corners) {
  return *std::max_element(leaf.corners.begin(), leaf.corners.end(), [&](int a, int b) {
    return corners[static_cast<std::size_t>(a)].response < corners[static_cast<std::size_t>(b)].response;
  });
}

}  // namespace

std::vector<cv::KeyPoint> SpreadCorners(const std::vector<cv::KeyPoint>& corners, cv::Size area, int count) {
  if (static_cast<int>(corners.size()) <= count) {
    return corners;
  }
  // The leaf with the most corners is split first; ties go to the older leaf, so that the result is
  // repeatable.
  const auto later = [](const std::pair<std::size_t, int>& a, const std::pair<std::size_t, int>& b) {
    return a.first != b.first ? a.first < b.first : a.second > b.second;
  };
  std::vector<Leaf> leaves;
  std::priority_queue<std::pair<std::size_t, int>, std::vector<std::pair<std::size_t, int>>, decltype(later)>
      open(later);
  int filled = 0;
  const auto add = [&](Leaf leaf) {
    if (leaf.corners.empty()) {
      return;
    }
    ++filled;
    const std::size_t size = leaf.corners.size();
    leaves.push_back(std::move(leaf));
    if (size > 1) {
      open.emplace(size, static_cast<int>(leaves.size()) - 1);
    }
  };
  const int columns =
      std::max(1, static_cast<int>(std::lround(static_cast<double>(area.width) / area.height)));
  const float column_width = static_cast<float>(area.width) / static_cast<float>(columns);
  std::vector<Leaf> roots(static_cast<std::size_t>(columns));
  for (int i = 0; i < columns; ++i) {
    roots[static_cast<std::size_t>(i)].area = {static_cast<float>(i) * column_width, 0.0F, column_width,
                                               static_cast<float>(area.height)};
  }
  for (int i = 0; i < static_cast<int>(corners.size()); ++i) {
    const int column =
        std::min(columns - 1, static_cast<int>(corners[static_cast<std::size_t>(i)].pt.x / column_width));
    roots[static_cast<std::size_t>(column)].corners.push_back(i);
  }
  for (Leaf& root : roots) {
    add(std::move(root));
  }
  while (filled < count && !open.empty()) {
    const auto index = static_cast<std::size_t>(open.top().second);
    open.pop();
    const Leaf leaf = std::move(leaves[index]);
    leaves[index].corners.clear();
    --filled;
    if (leaf.area.width < 1.0F) {  // coinciding corners
      leaves[index] = {leaf.area, {Strongest(leaf, corners)}};
      ++filled;
      continue;
    }
    for (Leaf& child : Split(leaf, corners)) {
      add(std::move(child));
    }
  }
  std::vector<cv::KeyPoint> kept;
  kept.reserve(static_cast<std::size_t>(filled));
  for (const Leaf& leaf : leaves) {
    if (!leaf.corners.empty()) {
      kept.push_back(corners[static_cast<std::size_t>(Strongest(leaf, corners))]);
    }
  }
  return kept;
}

}  // namespace sqslam
