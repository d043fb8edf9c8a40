#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "slam/dense/stereo.h"

namespace sqslam {
namespace {

constexpr int kWidth = 7;
constexpr int kHeight = 6;
constexpr int kDepth = 9;

cv::Mat RandomCosts() {
  cv::Mat costs(kHeight, kWidth, CV_8UC(kDepth));
  cv::RNG(3).fill(costs.reshape(1), cv::RNG::UNIFORM, 0, 255);
  return costs;
}

// Cost of the best path that ends in the pixel on the plane and comes from this direction, from the paper's
// Eq. 11 as it stands: by recursion, without what is subtracted to keep numbers small.
double PathCost(const cv::Mat& costs, const cv::Mat& gray, const StereoOptions& options, int x, int y,
                int plane, int dx, int dy) {
  const double own = costs.ptr<std::uint8_t>(y, x)[plane];
  const int from_x = x - dx;
  const int from_y = y - dy;
  if (from_x < 0 || from_y < 0 || from_x >= kWidth || from_y >= kHeight) {
    return own;
  }
  const double contrast = std::abs(gray.at<std::uint8_t>(y, x) - gray.at<std::uint8_t>(from_y, from_x));
  const double large = std::max<double>(
      options.small_penalty, std::lround(options.large_penalty / (1.0 + contrast / options.edge_contrast)));
  double best = std::numeric_limits<double>::infinity();
  for (int last = 0; last < kDepth; ++last) {
    const int step = std::abs(last - plane);
    const double penalty = step == 0 ? 0.0 : step == 1 ? options.small_penalty : large;
    best = std::min(best, penalty + PathCost(costs, gray, options, from_x, from_y, last, dx, dy));
  }
  return own + best;
}

TEST(SemiGlobal, FindsPlaneOfLeastSumOfEightPaths) {
  const cv::Mat costs = RandomCosts();
  cv::Mat gray(kHeight, kWidth, CV_8U);
  cv::RNG(4).fill(gray, cv::RNG::UNIFORM, 0, 40);
  StereoOptions options;
  options.small_penalty = 20;
  options.large_penalty = 90;
  const PlaneMap map = AggregateSemiGlobally(costs, gray, options);
  constexpr std::array<std::pair<int, int>, 8> kDirections = {
      {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {-1, -1}, {1, -1}, {-1, 1}}};
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      // Sums of different directions are short of what is subtracted on the way, which is the same for all
      // planes.
      std::array<double, kDepth> sums{};
      for (int d = 0; d < kDepth; ++d) {
        for (const auto& [dx, dy] : kDirections) {
          sums[static_cast<std::size_t>(d)] += PathCost(costs, gray, options, x, y, d, dx, dy);
        }
      }
      const int best = static_cast<int>(std::min_element(sums.begin(), sums.end()) - sums.begin());
      EXPECT_NEAR(map.plane.at<float>(y, x), best, 0.5 + 1e-4) << x << " " << y;
    }
  }
}

TEST(SemiGlobal, InterpolatesBetweenPlanesByParabola) {
  cv::Mat costs(3, 3, CV_8UC(kDepth));
  constexpr double kTrue = 4.3;
  for (int pixel = 0; pixel < 9; ++pixel) {
    for (int d = 0; d < kDepth; ++d) {
      costs.ptr<std::uint8_t>(pixel / 3, pixel % 3)[d] =
          static_cast<std::uint8_t>(std::lround(10.0 + 8.0 * (d - kTrue) * (d - kTrue)));
    }
  }
  StereoOptions options;
  options.small_penalty = 200;  // steps never pay
  options.large_penalty = 200;
  const PlaneMap map = AggregateSemiGlobally(costs, cv::Mat(3, 3, CV_8U, cv::Scalar(0)), options);
  EXPECT_NEAR(map.plane.at<float>(1, 1), kTrue, 0.05);
  EXPECT_EQ(map.cost.at<std::uint8_t>(1, 1), costs.ptr<std::uint8_t>(1, 1)[4]);
}

}  // namespace
}  // namespace sqslam
