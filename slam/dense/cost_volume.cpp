#include "slam/dense/cost_volume.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "slam/util/wide_registers.h"

namespace sqslam {
namespace {

constexpr int kGroup = 16;  // planes swept before they are transposed into the volume

SQSLAM_WIDE_REGISTERS void CostsOf(int width, const float* __restrict score, std::uint8_t* __restrict cost) {
  for (int x = 0; x < width; ++x) {
    const float agreement = score[x] > 0.0F ? score[x] : 0.0F;
    cost[x] = static_cast<std::uint8_t>(static_cast<std::int32_t>(254.5F - 254.0F * agreement));
  }
}

// Costs of a path at a pixel for all planes (Eq. 13 of the paper). `last`: those at the previous pixel,
// padded with a large cost on both ends; `least`: their minimum. Adds to `sums` and returns the new minimum.
SQSLAM_WIDE_REGISTERS std::int16_t Step(int planes, const std::uint8_t* __restrict costs,
                                        const std::int16_t* __restrict last, std::int16_t least,
                                        std::int16_t small_penalty, std::int16_t large_penalty,
                                        std::int16_t* __restrict path, std::int16_t* __restrict sums) {
  const auto jump = static_cast<std::int16_t>(least + large_penalty);
  std::int16_t smallest = std::numeric_limits<std::int16_t>::max();
  for (int d = 0; d < planes; ++d) {
    const std::int16_t down = last[d - 1];
    const std::int16_t up = last[d + 1];
    std::int16_t near = down < up ? down : up;
    near = static_cast<std::int16_t>(near + small_penalty);
    std::int16_t from = last[d] < near ? last[d] : near;
    from = from < jump ? from : jump;
    const auto cost = static_cast<std::int16_t>(costs[d] + from - least);
    path[d] = cost;
    sums[d] = static_cast<std::int16_t>(sums[d] + cost);
    smallest = cost < smallest ? cost : smallest;
  }
  return smallest;
}

// Path costs at the pixels of a row, each padded with a large cost on both ends.
class PathRow {
 public:
  PathRow(int width, int planes)
      : stride_(static_cast<std::size_t>(planes) + 2),
        costs_(static_cast<std::size_t>(width) * stride_, kLarge),
        least_(static_cast<std::size_t>(width)) {}

  std::int16_t* At(int x) { return costs_.data() + static_cast<std::size_t>(x) * stride_ + 1; }
  std::int16_t& Least(int x) { return least_[static_cast<std::size_t>(x)]; }

 private:
  static constexpr std::int16_t kLarge = 16000;
  std::size_t stride_;
  std::vector<std::int16_t> costs_;
  std::vector<std::int16_t> least_;
};

// Half of the paths: from the left and from above, or if `back`, from the right and from below.
class Pass {
 public:
  Pass(const CostVolume& volume, const cv::Mat& gray, const StereoOptions& options, bool back)
      : volume_(volume),
        gray_(gray),
        back_(back),
        small_(static_cast<std::int16_t>(options.small_penalty)),
        now_(kPaths, PathRow(volume.width, volume.planes)),
        before_(now_) {
    for (int contrast = 0; contrast < 256; ++contrast) {
      const double large = options.large_penalty / (1.0 + contrast / options.edge_contrast);
      large_[static_cast<std::size_t>(contrast)] =
          std::max(small_, static_cast<std::int16_t>(std::lround(large)));
    }
  }

  // Adds the costs of the paths to `sums` ([column][plane]) of the next row.
  void AddRow(int y, std::int16_t* sums) {
    const int step = back_ ? -1 : 1;
    const int first = back_ ? volume_.width - 1 : 0;
    std::swap(now_, before_);
    for (int i = 0, x = first; i < volume_.width; ++i, x += step) {
      std::int16_t* pixel_sums =
          sums + static_cast<std::size_t>(x) * static_cast<std::size_t>(volume_.planes);
      AddStep(0, x, y, x - step, y, now_[0], pixel_sums);
      for (int p = 1; p < kPaths; ++p) {
        AddStep(p, x, y, x + (p - 2), y - step, before_[static_cast<std::size_t>(p)], pixel_sums);
      }
    }
  }

 private:
  static constexpr int kPaths = 4;

  void AddStep(int path, int x, int y, int from_x, int from_y, PathRow& last, std::int16_t* sums) {
    PathRow& now = now_[static_cast<std::size_t>(path)];
    const std::uint8_t* costs = volume_.At(x, y);
    if (from_x < 0 || from_x >= volume_.width || from_y < 0 || from_y >= volume_.height) {
      std::int16_t least = std::numeric_limits<std::int16_t>::max();
      std::int16_t* start = now.At(x);
      for (int d = 0; d < volume_.planes; ++d) {
        start[d] = costs[d];
        sums[d] = static_cast<std::int16_t>(sums[d] + costs[d]);
        least = std::min(least, start[d]);
      }
      now.Least(x) = least;
      return;
    }
    const int contrast = std::abs(gray_.at<std::uint8_t>(y, x) - gray_.at<std::uint8_t>(from_y, from_x));
    now.Least(x) = Step(volume_.planes, costs, last.At(from_x), last.Least(from_x), small_,
                        large_[static_cast<std::size_t>(contrast)], now.At(x), sums);
  }

  const CostVolume& volume_;
  const cv::Mat& gray_;
  bool back_;
  std::int16_t small_;
  std::array<std::int16_t, 256> large_{};  // by the contrast between the pixels
  std::vector<PathRow> now_, before_;      // by path
};

// Returns the plane of the least sum, refined by the parabola through it and its neighbours.
SQSLAM_WIDE_REGISTERS float LeastPlane(const std::int16_t* sums, int planes) {
  std::int16_t least = sums[0];
  for (int d = 1; d < planes; ++d) {
    least = sums[d] < least ? sums[d] : least;
  }
  const int d = static_cast<int>(std::find(sums, sums + planes, least) - sums);
  if (d == 0 || d == planes - 1) {
    return static_cast<float>(d);
  }
  const auto bend = static_cast<float>(sums[d - 1] - 2 * sums[d] + sums[d + 1]);
  return static_cast<float>(d) +
         (bend > 0.0F ? 0.5F * static_cast<float>(sums[d - 1] - sums[d + 1]) / bend : 0.0F);
}

}  // namespace

CostVolume SweepPlanes(PatchScores& scores, const DepthRange& range, int planes) {
  const int width = scores.Width();
  CostVolume volume{width, scores.Height(), planes, {}};
  const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(volume.height);
  const auto depth = static_cast<std::size_t>(planes);
  volume.costs.resize(pixels * depth);
  std::vector<std::uint8_t> group(pixels * kGroup);
  std::vector<float> inverse_depth(static_cast<std::size_t>(width));
  for (int first = 0; first < planes; first += kGroup) {
    const auto count = static_cast<std::size_t>(std::min(kGroup, planes - first));
    for (std::size_t k = 0; k < count; ++k) {
      const double share = (first + static_cast<double>(k)) / (planes - 1);
      const double inverse = (1.0 - share) / range.farthest + share / range.nearest;
      std::ranges::fill(inverse_depth, static_cast<float>(inverse));
      std::uint8_t* plane = group.data() + k * pixels;
      scores.Visit([&](int) { return inverse_depth.data(); },
                   [&](int y, const float* score) {
                     CostsOf(width, score,
                             plane + static_cast<std::size_t>(y) * static_cast<std::size_t>(width));
                   });
    }
    for (std::size_t i = 0; i < pixels; ++i) {
      std::uint8_t* costs = volume.costs.data() + i * depth + static_cast<std::size_t>(first);
      for (std::size_t k = 0; k < count; ++k) {
        costs[k] = group[k * pixels + i];
      }
    }
  }
  return volume;
}

PlaneMap AggregateSemiGlobally(const CostVolume& volume, const cv::Mat& gray, const StereoOptions& options) {
  const auto row_sums = static_cast<std::size_t>(volume.width) * static_cast<std::size_t>(volume.planes);
  std::vector<std::int16_t> sums(row_sums * static_cast<std::size_t>(volume.height));
  Pass forth(volume, gray, options, false);
  for (int y = 0; y < volume.height; ++y) {
    forth.AddRow(y, sums.data() + static_cast<std::size_t>(y) * row_sums);
  }
  PlaneMap map{cv::Mat(volume.height, volume.width, CV_32F), cv::Mat(volume.height, volume.width, CV_8U)};
  Pass back(volume, gray, options, true);
  for (int y = volume.height - 1; y >= 0; --y) {
    std::int16_t* row = sums.data() + static_cast<std::size_t>(y) * row_sums;
    back.AddRow(y, row);
    for (int x = 0; x < volume.width; ++x) {
      const float plane = LeastPlane(
          row + static_cast<std::size_t>(x) * static_cast<std::size_t>(volume.planes), volume.planes);
      map.plane.at<float>(y, x) = plane;
      map.cost.at<std::uint8_t>(y, x) = volume.At(x, y)[std::lround(plane)];
    }
  }
  return map;
}

}  // namespace sqslam
