#include "slam/features/corner_refinement.h"

#include <algorithm>
#include <array>
#include <cstdint>

namespace sqslam {
namespace {

constexpr int kCircle = 16;  // pixels of the circle of radius 3
constexpr int kArc = 9;      // of them in a row are darker or brighter than the centre of a corner

// The circle, with its first pixels repeated so that no arc runs over the end.
using CircleOffsets = std::array<std::ptrdiff_t, kCircle + kArc - 1>;

CircleOffsets OffsetsOfCircle(std::size_t step) {
  constexpr std::array<int, kCircle> x{0, 1, 2, 3, 3, 3, 2, 1, 0, -1, -2, -3, -3, -3, -2, -1};
  constexpr std::array<int, kCircle> y{3, 3, 2, 1, 0, -1, -2, -3, -3, -3, -2, -1, 0, 1, 2, 3};
  CircleOffsets offsets{};
  for (std::size_t i = 0; i < offsets.size(); ++i) {
    offsets[i] = y[i % kCircle] * static_cast<std::ptrdiff_t>(step) + x[i % kCircle];
  }
  return offsets;
}

// Negative where the pixel is no corner at any threshold. Minima over 9 in a row as minima of minima over 2,
// 4 and 8: loops of fixed length that compilers turn into a few vector instructions.
float FastScore(const std::uint8_t* center, const CircleOffsets& offsets) {
  std::array<std::int16_t, kCircle + kArc - 1> darker{};  // than the centre by how much
  for (std::size_t i = 0; i < darker.size(); ++i) {
    darker[i] = static_cast<std::int16_t>(*center - center[offsets[i]]);
  }
  std::array<std::int16_t, kCircle + 7> low{};
  std::array<std::int16_t, kCircle + 7> high{};
  for (std::size_t i = 0; i < low.size(); ++i) {
    low[i] = std::min(darker[i], darker[i + 1]);
    high[i] = std::max(darker[i], darker[i + 1]);
  }
  for (const std::size_t span : {std::size_t{2}, std::size_t{4}}) {
    for (std::size_t i = 0; i + span < low.size(); ++i) {
      low[i] = std::min(low[i], low[i + span]);
      high[i] = std::max(high[i], high[i + span]);
    }
  }
  std::int16_t score = -255;
  for (std::size_t i = 0; i < kCircle; ++i) {
    const std::int16_t all_darker = std::min(low[i], darker[i + kArc - 1]);
    const auto all_brighter = static_cast<std::int16_t>(-std::max(high[i], darker[i + kArc - 1]));
    score = std::max({score, all_darker, all_brighter});
  }
  return score;
}

// Where the parabola through three neighbouring values has its top; zero where it has none.
float TopOfParabola(float before, float middle, float after) {
  const float curvature = before - 2.0F * middle + after;
  return curvature < 0.0F
             ? std::clamp(0.5F * (before - after) / curvature, -kMaxCornerOffset, kMaxCornerOffset)
             : 0.0F;
}

}  // namespace

cv::Point2f RefineCorner(const cv::Mat& image, const cv::Point& corner) {
  const CircleOffsets offsets = OffsetsOfCircle(image.step);
  std::array<float, 3> rows{};
  std::array<float, 3> columns{};
  for (int y = 0; y < 3; ++y) {
    const std::uint8_t* row = image.ptr<std::uint8_t>(corner.y + y - 1) + corner.x - 1;
    for (int x = 0; x < 3; ++x) {
      const float score = FastScore(row + x, offsets);
      rows[static_cast<std::size_t>(y)] += x == 1 ? 2.0F * score : score;
      columns[static_cast<std::size_t>(x)] += y == 1 ? 2.0F * score : score;
    }
  }
  return {TopOfParabola(columns[0], columns[1], columns[2]), TopOfParabola(rows[0], rows[1], rows[2])};
}

}  // namespace sqslam
