#include "slam/features/matching.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <opencv2/core/hal/hal.hpp>

namespace sqslam {

int HammingDistance(const Descriptor& a, const Descriptor& b) {
  return cv::hal::normHamming(a.data(), b.data(), static_cast<int>(a.size()));
}

std::vector<int> ConsistentRotations(const std::vector<std::pair<float, float>>& angles) {
  constexpr int kBins = 30;
  constexpr float kBinWidth = 360.0F / kBins;
  constexpr double kMinShareOfFullest = 0.1;  // a second or third peak counts only if it is no mere noise
  const auto bin_of = [&](const std::pair<float, float>& pair) {
    float difference = pair.first - pair.second;
    difference += difference < 0.0F ? 360.0F : 0.0F;
    return static_cast<int>(difference / kBinWidth + 0.5F) % kBins;
  };
  std::array<int, kBins> histogram{};
  for (const auto& pair : angles) {
    ++histogram[static_cast<std::size_t>(bin_of(pair))];
  }
  std::array<int, kBins> order{};
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    return histogram[static_cast<std::size_t>(a)] > histogram[static_cast<std::size_t>(b)];
  });
  std::array<bool, kBins> good{};
  for (int i = 0; i < 3; ++i) {
    const auto bin = static_cast<std::size_t>(order[static_cast<std::size_t>(i)]);
    good[bin] = histogram[bin] >= kMinShareOfFullest * histogram[static_cast<std::size_t>(order[0])];
  }
  std::vector<int> kept;
  for (std::size_t i = 0; i < angles.size(); ++i) {
    if (good[static_cast<std::size_t>(bin_of(angles[i]))]) {
      kept.push_back(static_cast<int>(i));
    }
  }
  return kept;
}

std::vector<PredictionMatch> MatchPredictions(std::span<const PredictedPoint> predictions,
                                              const FrameFeatures& features, const std::vector<bool>& taken,
                                              int max_distance, double ratio) {
  struct Claim {
    int distance = std::numeric_limits<int>::max();
    int prediction = -1;
  };
  std::vector<Claim> claims(features.Size());
  for (std::size_t p = 0; p < predictions.size(); ++p) {
    const PredictedPoint& prediction = predictions[p];
    int best = std::numeric_limits<int>::max();
    int second = best;
    int best_keypoint = -1;
    int second_octave = -1;
    features.grid.ForEachNear(prediction.pixel, prediction.radius, [&](int index) {
      const auto i = static_cast<std::size_t>(index);
      const Keypoint& keypoint = features.keypoints[i];
      if ((!taken.empty() && taken[i]) || keypoint.octave < prediction.min_octave ||
          keypoint.octave > prediction.max_octave ||
          (keypoint.pixel - prediction.pixel).squaredNorm() > prediction.radius * prediction.radius) {
        return;
      }
      const int distance = HammingDistance(*prediction.descriptor, features.descriptors[i]);
      if (distance < best) {
        second = best;
        second_octave =
            best_keypoint >= 0 ? features.keypoints[static_cast<std::size_t>(best_keypoint)].octave : -1;
        best = distance;
        best_keypoint = index;
      } else if (distance < second) {
        second = distance;
        second_octave = keypoint.octave;
      }
    });
    if (best > max_distance) {
      continue;
    }
    const auto k = static_cast<std::size_t>(best_keypoint);
    const bool ambiguous = second_octave == features.keypoints[k].octave && best > ratio * second;
    if (!ambiguous && best < claims[k].distance) {
      claims[k] = {best, static_cast<int>(p)};
    }
  }
  std::vector<PredictionMatch> matches;
  std::vector<std::pair<float, float>> angles;
  bool check_rotation = true;
  for (std::size_t k = 0; k < claims.size(); ++k) {
    if (claims[k].prediction >= 0) {
      const PredictedPoint& prediction = predictions[static_cast<std::size_t>(claims[k].prediction)];
      check_rotation = check_rotation && prediction.angle >= 0.0F;
      matches.push_back({prediction.tag, static_cast<int>(k)});
      angles.emplace_back(prediction.angle, features.keypoints[k].angle);
    }
  }
  if (!check_rotation) {
    return matches;
  }
  std::vector<PredictionMatch> kept;
  for (const int i : ConsistentRotations(angles)) {
    kept.push_back(matches[static_cast<std::size_t>(i)]);
  }
  return kept;
}

std::vector<std::pair<int, int>> MatchAll(const FrameFeatures& a, const FrameFeatures& b,
                                          const std::vector<bool>& use_a, const std::vector<bool>& use_b,
                                          int max_distance, double ratio) {
  struct Best {
    int distance = std::numeric_limits<int>::max();
    int second = std::numeric_limits<int>::max();
    int index = -1;
  };
  const auto update = [](Best& best, int distance, int index) {
    if (distance < best.distance) {
      best.second = best.distance;
      best.distance = distance;
      best.index = index;
    } else if (distance < best.second) {
      best.second = distance;
    }
  };
  std::vector<Best> best_of_a(a.Size());
  std::vector<Best> best_of_b(b.Size());
  for (std::size_t i = 0; i < a.Size(); ++i) {
    if (!use_a.empty() && !use_a[i]) {
      continue;
    }
    for (std::size_t j = 0; j < b.Size(); ++j) {
      if (!use_b.empty() && !use_b[j]) {
        continue;
      }
      const int distance = HammingDistance(a.descriptors[i], b.descriptors[j]);
      update(best_of_a[i], distance, static_cast<int>(j));
      update(best_of_b[j], distance, static_cast<int>(i));
    }
  }
  std::vector<std::pair<int, int>> matches;
  std::vector<std::pair<float, float>> angles;
  for (std::size_t i = 0; i < a.Size(); ++i) {
    const Best& best = best_of_a[i];
    if (best.index < 0 || best.distance > max_distance || best.distance > ratio * best.second ||
        best_of_b[static_cast<std::size_t>(best.index)].index != static_cast<int>(i)) {
      continue;
    }
    matches.emplace_back(static_cast<int>(i), best.index);
    angles.emplace_back(a.keypoints[i].angle, b.keypoints[static_cast<std::size_t>(best.index)].angle);
  }
  std::vector<std::pair<int, int>> kept;
  for (const int i : ConsistentRotations(angles)) {
    kept.push_back(matches[static_cast<std::size_t>(i)]);
  }
  return kept;
}

}  // namespace sqslam
