#include "slam/features/corner_refinement.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <opencv2/core/hal/intrin.hpp>

namespace sqslam {
namespace {

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

}  // namespace

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

}  // namespace sqslam
