#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <mutex>
#include <utility>
#include <vector>

#include "slam/features/frame_features.h"

namespace sqslam {

// Largest ratio of the distances of the best and the second match of two images (Lowe 2004, section 7.1).
inline constexpr double kMaxDistanceRatio = 0.85;

// Pairs (keypoint of one image, keypoint of the other).
using ImageMatches = std::vector<std::pair<int, int>>;

// Fewer matches do not show that two images share a view.
inline constexpr std::size_t kMinImageMatches = 16;

// Keeps what does not depend on the camera, for images that are mapped again and again to learn it (as
// COLMAP's database does): wide-baseline features of an image, and the putative matches of two images,
// keypoints whose descriptors are alike. May be used by several threads.
class FeatureDatabase {
 public:
  static constexpr int kMaxImages = 60;  // whose features are kept: 25 MB

  // Returns what `extract` returned for that image: features in distorted pixels. Those of further
  // images than kMaxImages are not kept.
  FrameFeaturesPtr FeaturesOf(const std::filesystem::path& image,
                              const std::function<FrameFeatures()>& extract);

  // Returns none if no fundamental matrix explains enough of them.
  ImageMatches MatchesOf(const FrameFeatures& a, const FrameFeatures& b);

  std::size_t Searched() const;  // pairs of images

 private:
  using Hash = std::size_t;  // of an image's descriptors

  mutable std::mutex mutex_;
  std::map<std::filesystem::path, FrameFeaturesPtr> features_;  // guarded by mutex_, as is the next
  std::map<std::pair<Hash, Hash>, ImageMatches> matches_;
};

}  // namespace sqslam
