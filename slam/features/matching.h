#pragma once

#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "slam/features/frame_features.h"

namespace sqslam {

// Returns the number of differing bits, 0 to 256.
int HammingDistance(const Descriptor& a, const Descriptor& b);

inline constexpr int kMaxUnguidedDistance = 50;  // bits: nothing else restricts the match
inline constexpr int kMaxGuidedDistance = 100;   // bits: geometry already restricts the candidates

// The two nearest descriptors to a given one; the first of equals.
struct NearestTwo {
  struct Candidate {
    int distance = std::numeric_limits<int>::max();  // bits
    int index = -1;
  };
  Candidate best;
  Candidate second;

  void Add(int distance, int index) {
    if (distance < best.distance) {
      second = std::exchange(best, {distance, index});
    } else if (distance < second.distance) {
      second = {distance, index};
    }
  }
};

// A map point as predicted in an image.
struct PredictedPoint {
  int tag = 0;  // the caller's own index, returned with the match
  Eigen::Vector2d pixel;
  double radius = 0.0;  // search radius in pixels
  int octave = 0;       // of the keypoint; adjacent ones match too
  const Descriptor* descriptor = nullptr;
  float angle = -1.0F;  // degrees; negative: unknown, no rotation check
};

// Returns pairs (tag, keypoint): the best keypoint for each prediction, each keypoint used once (the nearer
// descriptor wins). `taken[i]` excludes keypoint i from the search. A match needs a distance of at most
// `max_distance` and, among candidates of the same octave, best < ratio * second. If all angles are known,
// matches off the dominant rotations are dropped.
std::vector<std::pair<int, int>> MatchPredictions(std::span<const PredictedPoint> predictions,
                                                  const FrameFeatures& features,
                                                  const std::vector<bool>& taken, int max_distance,
                                                  double ratio);

// Returns pairs (index in a, index in b) of mutual nearest neighbours, with ratio test and rotation check.
// `use_a`, `use_b` restrict the search (empty: all).
std::vector<std::pair<int, int>> MatchAll(const FrameFeatures& a, const FrameFeatures& b,
                                          const std::vector<bool>& use_a, const std::vector<bool>& use_b,
                                          int max_distance, double ratio);

// Returns pairs (index in a, index in b) of mutual nearest neighbours among the keypoints that lie within
// `max_error` pixels of each other's epipolar line (p_b^T F_ba p_a = 0), with ratio test and rotation check.
// The line excludes most keypoints that merely look alike, so that more of the true matches pass the ratio
// test.
std::vector<std::pair<int, int>> MatchAlongEpipolarLines(const FrameFeatures& a, const FrameFeatures& b,
                                                         const Eigen::Matrix3d& F_ba, double max_error,
                                                         int max_distance, double ratio);

// Returns the indices of pairs with angle_a - angle_b (degrees) in one of the three fullest of 30 bins.
std::vector<int> ConsistentRotations(const std::vector<std::pair<float, float>>& angles);

// Returns the matches without those off the dominant rotations.
template <typename Match>
std::vector<Match> KeepConsistent(const std::vector<Match>& matches,
                                  const std::vector<std::pair<float, float>>& angles) {
  std::vector<Match> kept;
  for (const int i : ConsistentRotations(angles)) {
    kept.push_back(matches[i]);
  }
  return kept;
}

}  // namespace sqslam
