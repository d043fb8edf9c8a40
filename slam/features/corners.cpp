#include "slam/features/corners.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <opencv2/core/hal/intrin.hpp>
#include <opencv2/features2d.hpp>
#include <queue>
#include <span>
#include <utility>

namespace sqslam {
namespace {

constexpr int kCellSize = 32;   // at least, pixels
constexpr int kFastRadius = 3;  // pixels that FAST skips at the borders

cv::Rect Grown(const cv::Rect& area) {
  return {area.x - kFastRadius, area.y - kFastRadius, area.width + 2 * kFastRadius,
          area.height + 2 * kFastRadius};
}

// Cell `index` of `cells` begins at pixel length * index / cells.
int CellAt(float place, int length, int cells) {
  return ((static_cast<int>(place) + 1) * cells - 1) / length;
}

constexpr int kCircle = 16;  // pixels of the circle of radius 3
constexpr int kArc = 9;      // pixels in a row that are darker or brighter than the centre of a corner

constexpr std::array<int, kCircle> kCircleX{0, 1, 2, 3, 3, 3, 2, 1, 0, -1, -2, -3, -3, -3, -2, -1};
constexpr std::array<int, kCircle> kCircleY{3, 3, 2, 1, 0, -1, -2, -3, -3, -3, -2, -1, 0, 1, 2, 3};

int LoadWord(const std::uint8_t* bytes) {
  int word = 0;
  std::memcpy(&word, bytes, sizeof(word));
  return word;
}

// Loads four pixels of a row into the lower half and the four below them into the upper half.
cv::v_int16x8 LoadTwoRows(const std::uint8_t* pixels, std::ptrdiff_t step) {
  const cv::v_uint8x16 rows =
      cv::v_reinterpret_as_u8(cv::v_int32x4(LoadWord(pixels), LoadWord(pixels + step), 0, 0));
  return cv::v_reinterpret_as_s16(cv::v_expand_low(rows));
}

// Returns the FAST scores of the pixel at `pixels`, of its three right neighbours and of the four pixels
// below them; negative if a pixel is no corner at any threshold. Minima over 9 in a row are built from minima
// over 2, 4 and 8.
cv::v_int16x8 FastScores(const std::uint8_t* pixels, std::ptrdiff_t step) {
  const cv::v_int16x8 centers = LoadTwoRows(pixels, step);
  // The circle, with its first pixels repeated so that no arc wraps around.
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

// Returns the offset of the top of the parabola through three neighbouring values; 0 if it has none.
float TopOfParabola(float before, float middle, float after) {
  const float curvature = before - 2.0F * middle + after;
  return curvature < 0.0F
             ? std::clamp(0.5F * (before - after) / curvature, -kMaxCornerOffset, kMaxCornerOffset)
             : 0.0F;
}

using CornerSpan = std::span<const cv::KeyPoint*>;

// Partitions corners by their positions; both parts keep their order.
std::pair<CornerSpan, CornerSpan> SplitCorners(CornerSpan corners, auto&& chosen) {
  const auto middle = std::stable_partition(corners.begin(), corners.end(),
                                            [&](const cv::KeyPoint* corner) { return chosen(corner->pt); });
  const auto count = static_cast<std::size_t>(middle - corners.begin());
  return {corners.first(count), corners.subspan(count)};
}

// A quadtree over the corners of an area.
class Quadtree {
 public:
  Quadtree(const std::vector<cv::KeyPoint>& corners, cv::Size area) {
    for (const cv::KeyPoint& corner : corners) {
      order_.push_back(&corner);
    }
    const int columns =
        std::max(1, static_cast<int>(std::lround(static_cast<double>(area.width) / area.height)));
    const float width = static_cast<float>(area.width) / static_cast<float>(columns);
    CornerSpan rest(order_);
    for (int i = 0; i < columns; ++i) {
      const auto [column, others] = SplitCorners(rest, [&](const cv::Point2f& p) {
        return std::min(columns - 1, static_cast<int>(p.x / width)) == i;
      });
      AddLeaf({static_cast<float>(i) * width, 0.0F, width, static_cast<float>(area.height)}, column);
      rest = others;
    }
  }

  // Splits the leaf with the most corners (the older one of equals) until `count` leaves are non-empty.
  void Split(int count) {
    while (filled_ < count && !open_.empty()) {
      const int index = -open_.top().second;
      open_.pop();
      if (leaves_[index].area.width >= 1.0F) {  // else the corners coincide: their leaf stays
        --filled_;
        SplitLeaf(std::exchange(leaves_[index], {}));
      }
    }
  }

  std::vector<cv::KeyPoint> StrongestOfEach() const {
    std::vector<cv::KeyPoint> strongest;
    for (const Leaf& leaf : leaves_) {
      if (!leaf.corners.empty()) {
        strongest.push_back(**std::ranges::max_element(leaf.corners, {}, &cv::KeyPoint::response));
      }
    }
    return strongest;
  }

 private:
  struct Leaf {
    cv::Rect2f area;
    CornerSpan corners;  // none: it has been split
  };

  void AddLeaf(const cv::Rect2f& area, CornerSpan corners) {
    if (corners.size() > 1) {
      open_.emplace(corners.size(), -static_cast<int>(leaves_.size()));
    }
    if (!corners.empty()) {
      leaves_.push_back({area, corners});
      ++filled_;
    }
  }

  void SplitLeaf(const Leaf& leaf) {
    const cv::Size2f half(0.5F * leaf.area.width, 0.5F * leaf.area.height);
    const cv::Point2f middle(leaf.area.x + half.width, leaf.area.y + half.height);
    const auto [upper, lower] =
        SplitCorners(leaf.corners, [&](const cv::Point2f& p) { return p.y < middle.y; });
    for (const auto& [y, row] : {std::pair(leaf.area.y, upper), std::pair(middle.y, lower)}) {
      const auto [left, right] = SplitCorners(row, [&](const cv::Point2f& p) { return p.x < middle.x; });
      AddLeaf({{leaf.area.x, y}, half}, left);
      AddLeaf({{middle.x, y}, half}, right);
    }
  }

  std::vector<const cv::KeyPoint*> order_;  // grouped by leaf
  std::vector<Leaf> leaves_;
  std::priority_queue<std::pair<std::size_t, int>>
      open_;  // number of corners of a splittable leaf, minus its index
  int filled_ = 0;
};

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
    filled_[CellAt(corner.pt.y, inner.height, rows) * columns + CellAt(corner.pt.x, inner.width, columns)] =
        1;
  }
  for (int row = 0; row < rows; ++row) {
    const int y0 = inner.height * row / rows;
    const int y1 = inner.height * (row + 1) / rows;
    const char* filled = &filled_[row * columns];
    // Adjacent empty cells are joined: each call of FAST has an overhead.
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

bool IsOnEdge(const cv::Mat& image, const cv::Point& pixel) {
  constexpr int kRadius = 3;
  constexpr double kHarris = 0.04;
  const auto step = static_cast<std::ptrdiff_t>(image.step);
  int xx = 0;
  int xy = 0;
  int yy = 0;
  for (int y = pixel.y - kRadius; y <= pixel.y + kRadius; ++y) {
    const std::uint8_t* row = image.ptr<std::uint8_t>(y) + pixel.x;
    for (int x = -kRadius; x <= kRadius; ++x) {
      const int dx = row[x + 1] - row[x - 1];
      const int dy = row[x + step] - row[x - step];
      xx += dx * dx;
      xy += dx * dy;
      yy += dy * dy;
    }
  }
  const double determinant = static_cast<double>(xx) * yy - static_cast<double>(xy) * xy;
  const double trace = static_cast<double>(xx) + yy;
  return determinant <= kHarris * trace * trace;
}

cv::Point2f RefineCorner(const cv::Mat& image, const cv::Point& corner) {
  const auto step = static_cast<std::ptrdiff_t>(image.step);
  const std::uint8_t* first = image.ptr<std::uint8_t>(corner.y - 1) + corner.x - 1;
  alignas(16) std::array<std::int16_t, 16> scores;  // rows of four, of which three count
  cv::v_store(scores.data(), FastScores(first, step));
  cv::v_store(&scores[8], FastScores(first + step, step));
  const auto score = [&](int x, int y) {
    // The second block begins one row further down to avoid reading below the neighbourhood.
    return static_cast<float>(scores[x + 4 * (y < 2 ? y : 3)]);
  };
  std::array<float, 3> rows{};
  std::array<float, 3> columns{};
  for (int y = 0; y < 3; ++y) {
    for (int x = 0; x < 3; ++x) {
      rows[y] += x == 1 ? 2.0F * score(x, y) : score(x, y);
      columns[x] += y == 1 ? 2.0F * score(x, y) : score(x, y);
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
  tree.Split(count);
  return tree.StrongestOfEach();
}

}  // namespace sqslam
