#include "slam/features/matching.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
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

std::vector<DescriptorWords> WordsOf(const std::vector<Descriptor>& descriptors) {
  std::vector<DescriptorWords> words(descriptors.size());
  for (std::size_t i = 0; i < words.size(); ++i) {
    std::memcpy(&words[i], descriptors[i].data(), sizeof(DescriptorWords));
  }
  return words;
}

// Hamming distances of one descriptor to all others: the processor's own bit count takes a third of the time
// of a call for each pair.
SQSLAM_WIDE_REGISTERS void Distances(const DescriptorWords& a, const std::vector<DescriptorWords>& others,
                                     std::vector<int>& distances) {
  for (std::size_t j = 0; j < others.size(); ++j) {
    const DescriptorWords& b = others[j];
    distances[j] = std::popcount(a[0] ^ b[0]) + std::popcount(a[1] ^ b[1]) + std::popcount(a[2] ^ b[2]) +
                   std::popcount(a[3] ^ b[3]);
  }
}

}  // namespace

std::vector<std::pair<int, int>> MatchAll(const FrameFeatures& a, const FrameFeatures& b,
                                          const std::vector<bool>& use_a, const std::vector<bool>& use_b,
                                          int max_distance, double ratio) {
  const std::vector<DescriptorWords> words_a = WordsOf(a.descriptors);
  const std::vector<DescriptorWords> words_b = WordsOf(b.descriptors);
  std::vector<int> distances(b.Size());
  std::vector<NearestTwo> nearest_of_a(a.Size());
  std::vector<NearestTwo> nearest_of_b(b.Size());
  for (std::size_t i = 0; i < a.Size(); ++i) {
    if (!use_a.empty() && !use_a[i]) {
      continue;
    }
    Distances(words_a[i], words_b, distances);
    for (std::size_t j = 0; j < b.Size(); ++j) {
      if (!use_b.empty() && !use_b[j]) {
        continue;
      }
      nearest_of_a[i].Add(distances[j], static_cast<int>(j));
      nearest_of_b[j].Add(distances[j], static_cast<int>(i));
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
