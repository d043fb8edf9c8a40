#include "slam/features/matching.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <limits>
#include <numeric>
#include <opencv2/core/hal/hal.hpp>

#include "slam/util/wide_registers.h"

namespace sqslam {

int HammingDistance(const Descriptor& a, const Descriptor& b) {
  return cv::hal::normHamming(a.data(), b.data(), static_cast<int>(a.size()));
}

std::vector<int> ConsistentRotations(const std::vector<std::pair<float, float>>& angles) {
  constexpr int kBins = 30;
  constexpr float kBinWidth = 360.0F / kBins;
  constexpr double kMinShareOfFullest = 0.1;  // lower second and third peaks are noise
  const auto bin_of = [&](const std::pair<float, float>& pair) {
    float difference = pair.first - pair.second;
    difference += difference < 0.0F ? 360.0F : 0.0F;
    return static_cast<int>(difference / kBinWidth + 0.5F) % kBins;
  };
  std::array<int, kBins> histogram{};
  for (const auto& pair : angles) {
    ++histogram[bin_of(pair)];
  }
  std::array<int, kBins> order{};
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, [&](int a, int b) { return histogram[a] > histogram[b]; });
  std::array<bool, kBins> good{};
  for (int i = 0; i < 3; ++i) {
    const auto bin = static_cast<std::size_t>(order[i]);
    good[bin] = histogram[bin] >= kMinShareOfFullest * histogram[order[0]];
  }
  std::vector<int> kept;
  for (std::size_t i = 0; i < angles.size(); ++i) {
    if (good[bin_of(angles[i])]) {
      kept.push_back(static_cast<int>(i));
    }
  }
  return kept;
}

std::vector<std::pair<int, int>> MatchPredictions(std::span<const PredictedPoint> predictions,
                                                  const FrameFeatures& features,
                                                  const std::vector<bool>& taken, int max_distance,
                                                  double ratio) {
  std::vector<NearestTwo::Candidate> claims(features.Size());  // by keypoint: the nearest prediction
  for (std::size_t p = 0; p < predictions.size(); ++p) {
    const PredictedPoint& prediction = predictions[p];
    NearestTwo nearest;
    features.grid.ForEachNear(prediction.pixel, prediction.radius, [&](int i) {
      const Keypoint& keypoint = features.keypoints[i];
      if ((taken.empty() || !taken[i]) && std::abs(keypoint.octave - prediction.octave) <= 1 &&
          (keypoint.pixel - prediction.pixel).squaredNorm() <= prediction.radius * prediction.radius) {
        nearest.Add(HammingDistance(*prediction.descriptor, features.descriptors[i]), i);
      }
    });
    const auto [best, second] = nearest;
    if (best.distance > max_distance) {
      continue;
    }
    const bool ambiguous = second.index >= 0 && best.distance > ratio * second.distance &&
                           features.keypoints[second.index].octave == features.keypoints[best.index].octave;
    if (!ambiguous && best.distance < claims[best.index].distance) {
      claims[best.index] = {best.distance, static_cast<int>(p)};
    }
  }
  std::vector<std::pair<int, int>> matches;
  std::vector<std::pair<float, float>> angles;
  bool check_rotation = true;
  for (std::size_t k = 0; k < claims.size(); ++k) {
    if (claims[k].index >= 0) {
      const PredictedPoint& prediction = predictions[claims[k].index];
      check_rotation = check_rotation && prediction.angle >= 0.0F;
      matches.emplace_back(prediction.tag, static_cast<int>(k));
      angles.emplace_back(prediction.angle, features.keypoints[k].angle);
    }
  }
  return check_rotation ? KeepConsistent(matches, angles) : matches;
}

namespace {

using DescriptorWords = std::array<std::uint64_t, 4>;
static_assert(sizeof(DescriptorWords) == sizeof(Descriptor));

// Descriptors that may be matched, with their indices.
struct UsedDescriptors {
  std::vector<DescriptorWords> words;
  std::vector<int> indices;

  UsedDescriptors(const std::vector<Descriptor>& descriptors, const std::vector<bool>& use) {
    for (std::size_t i = 0; i < descriptors.size(); ++i) {
      if (use.empty() || use[i]) {
        std::memcpy(&words.emplace_back(), descriptors[i].data(), sizeof(DescriptorWords));
        indices.push_back(static_cast<int>(i));
      }
    }
  }
};

// A distance and, in the lower bits, whose it is: the smaller of two is the nearer, the first of equals.
using RankedDistance = std::uint32_t;
constexpr int kIndexBits = 20;
constexpr RankedDistance kNoDistance = std::numeric_limits<RankedDistance>::max();
constexpr int DistanceOf(RankedDistance ranked) { return static_cast<int>(ranked >> kIndexBits); }
constexpr int IndexOf(RankedDistance ranked) { return static_cast<int>(ranked & ((1U << kIndexBits) - 1)); }

struct RankedPair {
  RankedDistance best = kNoDistance;
  RankedDistance second = kNoDistance;
};

// Returns the two of the others that are nearest to descriptor `i`, and updates the nearest to each of them.
// The processor's own bit count takes a third of the time of a call for each pair; loops without conditions
// fill its wide registers, and where these count bits, it takes an eighth.
SQSLAM_WIDE_INTEGERS RankedPair NearestOf(const DescriptorWords& a, std::uint32_t i,
                                          const std::vector<DescriptorWords>& others,
                                          std::vector<RankedDistance>& to_others,
                                          std::vector<RankedDistance>& nearest_of_others) {
  const auto count = static_cast<std::uint32_t>(others.size());
  for (std::uint32_t j = 0; j < count; ++j) {
    const DescriptorWords& b = others[j];
    to_others[j] = static_cast<RankedDistance>(std::popcount(a[0] ^ b[0]) + std::popcount(a[1] ^ b[1]) +
                                               std::popcount(a[2] ^ b[2]) + std::popcount(a[3] ^ b[3]))
                   << kIndexBits;
  }
  for (std::uint32_t j = 0; j < count; ++j) {
    nearest_of_others[j] = std::min(nearest_of_others[j], to_others[j] | i);
    to_others[j] |= j;
  }
  RankedDistance best = kNoDistance;
  for (std::uint32_t j = 0; j < count; ++j) {
    best = std::min(best, to_others[j]);
  }
  RankedDistance above =
      kNoDistance;  // of the second over the next possible one; the best itself wraps round
  for (std::uint32_t j = 0; j < count; ++j) {
    above = std::min(above, to_others[j] - best - 1);
  }
  return {best, above == kNoDistance ? kNoDistance : best + 1 + above};
}

}  // namespace

std::vector<std::pair<int, int>> MatchAll(const FrameFeatures& a, const FrameFeatures& b,
                                          const std::vector<bool>& use_a, const std::vector<bool>& use_b,
                                          int max_distance, double ratio) {
  const UsedDescriptors used_a(a.descriptors, use_a);
  const UsedDescriptors used_b(b.descriptors, use_b);
  std::vector<RankedDistance> distances(used_b.words.size());
  std::vector<RankedDistance> nearest_of_b(used_b.words.size(), kNoDistance);
  std::vector<RankedPair> nearest_of_a;
  for (std::size_t i = 0; i < used_a.words.size(); ++i) {
    nearest_of_a.push_back(
        NearestOf(used_a.words[i], static_cast<std::uint32_t>(i), used_b.words, distances, nearest_of_b));
  }
  std::vector<std::pair<int, int>> matches;
  std::vector<std::pair<float, float>> angles;
  for (std::size_t k = 0; k < nearest_of_a.size(); ++k) {
    const auto [best, second] = nearest_of_a[k];
    const bool distinct = best != kNoDistance && DistanceOf(best) <= max_distance &&
                          DistanceOf(best) <= ratio * DistanceOf(second);
    if (distinct && IndexOf(nearest_of_b[IndexOf(best)]) == static_cast<int>(k)) {
      matches.emplace_back(used_a.indices[k], used_b.indices[IndexOf(best)]);
      angles.emplace_back(a.keypoints[matches.back().first].angle, b.keypoints[matches.back().second].angle);
    }
  }
  return KeepConsistent(matches, angles);
}

namespace {

// A line of an image, n . p + d = 0 with a unit normal n, and a pixel.
struct PixelAndLine {
  float x = 0.0F, y = 0.0F;
  float n_x = 0.0F, n_y = 0.0F, d = std::numeric_limits<float>::infinity();
};

PixelAndLine EpipolarLineOf(const Keypoint& keypoint, const Eigen::Matrix3d& F) {
  const Eigen::Vector3d line = F * keypoint.pixel.homogeneous();
  const Eigen::Vector3f unit = (line / line.head<2>().norm()).cast<float>();
  return {static_cast<float>(keypoint.pixel.x()), static_cast<float>(keypoint.pixel.y()), unit.x(), unit.y(),
          unit.z()};
}

// Sixteen keypoints of one image and their epipolar lines in another one, coordinate by coordinate: a loop
// over them fills wide registers.
struct KeypointBlock {
  static constexpr int kSize = 16;
  std::array<float, kSize> x, y, n_x, n_y, d;

  void Set(int k, const PixelAndLine& keypoint) {
    x[k] = keypoint.x;
    y[k] = keypoint.y;
    n_x[k] = keypoint.n_x;
    n_y[k] = keypoint.n_y;
    d[k] = keypoint.d;
  }
};

std::vector<KeypointBlock> BlocksOf(const FrameFeatures& features, const Eigen::Matrix3d& F) {
  constexpr std::size_t kSize = KeypointBlock::kSize;
  std::vector<KeypointBlock> blocks((features.Size() + kSize - 1) / kSize);
  for (std::size_t i = 0; i < blocks.size() * kSize; ++i) {
    const bool is_keypoint = i < features.Size();  // the last block is filled with lines infinitely far away
    blocks[i / kSize].Set(static_cast<int>(i % kSize),
                          is_keypoint ? EpipolarLineOf(features.keypoints[i], F) : PixelAndLine());
  }
  return blocks;
}

// Lists the keypoints of the blocks that lie within `max_gap` px of the other keypoint's line, as that does
// of theirs.
SQSLAM_WIDE_REGISTERS void ListNear(const std::vector<KeypointBlock>& blocks, const PixelAndLine& other,
                                    float max_gap, std::vector<int>& near) {
  near.clear();
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const KeypointBlock& block = blocks[b];
    std::array<float, KeypointBlock::kSize> gaps;
    int count = 0;
    for (int k = 0; k < KeypointBlock::kSize; ++k) {
      gaps[k] = std::max(std::abs(block.n_x[k] * other.x + block.n_y[k] * other.y + block.d[k]),
                         std::abs(other.n_x * block.x[k] + other.n_y * block.y[k] + other.d));
      count += gaps[k] <= max_gap ? 1 : 0;
    }
    for (int k = 0; count > 0 && k < KeypointBlock::kSize; ++k) {
      if (gaps[k] <= max_gap) {
        near.push_back(static_cast<int>(b) * KeypointBlock::kSize + k);
      }
    }
  }
}

}  // namespace

std::vector<std::pair<int, int>> MatchAlongEpipolarLines(const FrameFeatures& a, const FrameFeatures& b,
                                                         const Eigen::Matrix3d& F_ba, double max_error,
                                                         int max_distance, double ratio) {
  const std::vector<KeypointBlock> blocks_of_b = BlocksOf(b, F_ba.transpose());
  std::vector<NearestTwo> nearest_of_a(a.Size());
  std::vector<NearestTwo> nearest_of_b(b.Size());
  std::vector<int> near;
  for (std::size_t i = 0; i < a.Size(); ++i) {
    ListNear(blocks_of_b, EpipolarLineOf(a.keypoints[i], F_ba), static_cast<float>(max_error), near);
    for (const int j : near) {
      const int distance = HammingDistance(a.descriptors[i], b.descriptors[j]);
      nearest_of_a[i].Add(distance, j);
      nearest_of_b[j].Add(distance, static_cast<int>(i));
    }
  }
  std::vector<std::pair<int, int>> matches;
  std::vector<std::pair<float, float>> angles;
  for (std::size_t i = 0; i < a.Size(); ++i) {
    const auto [best, second] = nearest_of_a[i];
    if (best.index >= 0 && best.distance <= max_distance && best.distance <= ratio * second.distance &&
        nearest_of_b[best.index].best.index == static_cast<int>(i)) {
      matches.emplace_back(static_cast<int>(i), best.index);
      angles.emplace_back(a.keypoints[i].angle, b.keypoints[best.index].angle);
    }
  }
  return KeepConsistent(matches, angles);
}

}  // namespace sqslam
