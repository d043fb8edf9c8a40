#include "slam/features/corners.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <numeric>
#include <opencv2/core/hal/intrin.hpp>
#include <opencv2/features2d.hpp>
#include <queue>
#include <span>
#include <utility>

namespace sqslam {
namespace {

constexpr int kCellSize = 32;   // at least, pixels
constexpr int kFastRadius = 3;  // pixels that FAST leaves out at the edges

cv::Rect Grown(const cv::Rect& area) {
  return {area.x - kFastRadius, area.y - kFastRadius, area.width + 2 * kFastRadius,
          area.height + 2 * kFastRadius};
}

// Cell `index` of `cells` begins at pixel length * index / cells.
int CellAt(float place, int length, int cells) {
  return ((static_cast<int>(place) + 1) * cells - 1) / length;
}

constexpr int kCircle = 16;  // pixels of the circle of radius 3
constexpr int kArc = 9;      // so many of them in a row are darker or brighter than the centre of a corner

constexpr std::array<int, kCircle> kCircleX{0, 1, 2, 3, 3, 3, 2, 1, 0, -1, -2, -3, -3, -3, -2, -1};
constexpr std::array<int, kCircle> kCircleY{3, 3, 2, 1, 0, -1, -2, -3, -3, -3, -2, -1, 0, 1, 2, 3};

int LoadWord(const std::uint8_t* bytes) {
  int word = 0;
  std::memcpy(&word, bytes, sizeof(word));
  return word;
}

// Four pixels of a row in the lower half and the four below them in the upper half.
cv::v_int16x8 LoadTwoRows(const std::uint8_t* pixels, std::ptrdiff_t step) {
  const cv::v_uint8x16 rows =
      cv::v_reinterpret_as_u8(cv::v_int32x4(LoadWord(pixels), LoadWord(pixels + step), 0, 0));
  return cv::v_reinterpret_as_s16(cv::v_expand_low(rows));
}

// FAST scores of the pixel at `pixels`, of its three right neighbours and of the four pixels below them;
// negative where a pixel is no corner at any threshold. Minima over 9 in a row as minima of minima over 2, 4
// and 8.
cv::v_int16x8 FastScores(const std::uint8_t* pixels, std::ptrdiff_t step) {
  const cv::v_int16x8 centers = LoadTwoRows(pixels, step);
  // The circle, with its first pixels repeated so that no arc runs over the end.
  std::array<cv::v_int16x8, kCircle + kArc - 1> darker;  // than the centres by how much
  for (std::size_t i = 0; i < kCircle; ++i) {
    darker[i] = centers - LoadTwoRows(pixels + kCircleY[i] * step + kCircleX[i], step);
  }
  std::copy_n(darker.begin(), kArc - 1, darker.begin() + kCircle);
  std::array<cv::v_int16x8, kCircle + 7> low;
  std::array<cv::v_int16x8, kCircle + 7> high;
  for (std::size_t i = 0; i < low.size(); ++i) {
    low[i] = cv::v_min(darker[i], darker[i + 1]);
    high[i] = cv::v_max(darker[i], darker[i + 1]);
  }
  for (const std::size_t span : {std::size_t{2}, std::size_t{4}}) {
    for (std::size_t i = 0; i + span < low.size(); ++i) {
      low[i] = cv::v_min(low[i], low[i + span]);
      high[i] = cv::v_max(high[i], high[i + span]);
    }
  }
  cv::v_int16x8 all_darker = cv::v_setall_s16(-255);
  cv::v_int16x8 all_brighter = cv::v_setall_s16(255);
  for (std::size_t i = 0; i < kCircle; ++i) {
    all_darker = cv::v_max(all_darker, cv::v_min(low[i], darker[i + kArc - 1]));
    all_brighter = cv::v_min(all_brighter, cv::v_max(high[i], darker[i + kArc - 1]));
  }
  return cv::v_max(all_darker, cv::v_setzero_s16() - all_brighter);
}

// Place of the top of the parabola through three neighbouring values; zero where it has none.
float TopOfParabola(float before, float middle, float after) {
  const float curvature = before - 2.0F * middle + after;
  return curvature < 0.0F
             ? std::clamp(0.5F * (before - after) / curvature, -kMaxCornerOffset, kMaxCornerOffset)
             : 0.0F;
}

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

const std::vector<cv::KeyPoint>& CornerDetector::Detect(const cv::Mat& image, const cv::Rect& inner) {
  corners_.clear();
  if (inner.width < kCellSize || inner.height < kCellSize) {
    return corners_;
  }
  cv::FAST(image(Grown(inner)), corners_, threshold_, true);
  const int columns = inner.width / kCellSize;
  const int rows = inner.height / kCellSize;
  filled_.assign(static_cast<std::size_t>(columns * rows), 0);
  for (cv::KeyPoint& corner : corners_) {
    corner.pt -= cv::Point2f(kFastRadius, kFastRadius);
    filled_[static_cast<std::size_t>(CellAt(corner.pt.y, inner.height, rows) * columns +
                                     CellAt(corner.pt.x, inner.width, columns))] = 1;
  }
  for (int row = 0; row < rows; ++row) {
    const int y0 = inner.height * row / rows;
    const int y1 = inner.height * (row + 1) / rows;
    const char* filled = &filled_[static_cast<std::size_t>(row * columns)];
    // Empty neighbours at once: each call of FAST has its price.
    for (int begin = 0, end = 0; begin < columns; begin = end + 1) {
      for (end = begin; end < columns && filled[end] == 0; ++end) {
      }
      if (end > begin) {
        const int x0 = inner.width * begin / columns;
        const int x1 = inner.width * end / columns;
        DetectWeak(image, inner, {x0, y0, x1 - x0, y1 - y0});
      }
    }
  }
  return corners_;
}

void CornerDetector::DetectWeak(const cv::Mat& image, const cv::Rect& inner, const cv::Rect& cells) {
  cv::FAST(image(Grown(cells + inner.tl())), weak_, min_threshold_, true);
  for (cv::KeyPoint& corner : weak_) {
    corner.pt += cv::Point2f(cells.tl()) - cv::Point2f(kFastRadius, kFastRadius);
    corners_.push_back(corner);
  }
}

cv::Point2f RefineCorner(const cv::Mat& image, const cv::Point& corner) {
  const auto step = static_cast<std::ptrdiff_t>(image.step);
  const std::uint8_t* first = image.ptr<std::uint8_t>(corner.y - 1) + corner.x - 1;
  alignas(16) std::array<std::int16_t, 16> scores;  // rows of four, of which three count
  cv::v_store(scores.data(), FastScores(first, step));
  cv::v_store(&scores[8], FastScores(first + step, step));
  const auto score = [&](int x, int y) {
    // The second block begins one row further down, so that nothing below the neighbourhood is read.
    return static_cast<float>(scores[static_cast<std::size_t>(x + 4 * (y < 2 ? y : 3))]);
  };
  std::array<float, 3> rows{};
  std::array<float, 3> columns{};
  for (int y = 0; y < 3; ++y) {
    for (int x = 0; x < 3; ++x) {
      rows[static_cast<std::size_t>(y)] += x == 1 ? 2.0F * score(x, y) : score(x, y);
      columns[static_cast<std::size_t>(x)] += y == 1 ? 2.0F * score(x, y) : score(x, y);
    }
  }
  return {TopOfParabola(columns[0], columns[1], columns[2]), TopOfParabola(rows[0], rows[1], rows[2])};
}

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
