#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "slam/dense/dense_options.h"
#include "slam/dense/patch_scores.h"

namespace sqslam {

// Range of depths to search, map units.
struct DepthRange {
  double nearest = 0.0;
  double farthest = 0.0;
};

// Matching costs of a keyframe's pixels on planes parallel to its image, evenly spaced in inverse depth from
// the farthest (0) to the nearest: 0 for perfect agreement, 254 for none. A pixel's costs are contiguous.
struct CostVolume {
  int width = 0;
  int height = 0;
  int planes = 0;
  std::vector<std::uint8_t> costs;  // [row][column][plane]

  const std::uint8_t* At(int x, int y) const {
    return costs.data() +
           (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)) *
               static_cast<std::size_t>(planes);
  }
};

// Computes the costs by a plane sweep (Collins 1996; Gallup et al., CVPR 2007).
CostVolume SweepPlanes(PatchScores& scores, const DepthRange& range, int planes);

// The plane found for each pixel.
struct PlaneMap {
  cv::Mat plane;  // 32FC1, may lie between planes; below 0: none
  cv::Mat cost;   // 8UC1, matching cost on the plane found
};

// Semi-global matching (Hirschmueller, PAMI 2008) along eight paths: minimizes the sum of matching costs and
// of penalties for steps between neighbouring pixels, then refines the plane by a parabola. `gray`: the
// keyframe (8UC1); large steps cost less at its edges.
PlaneMap AggregateSemiGlobally(const CostVolume& volume, const cv::Mat& gray, const StereoOptions& options);

}  // namespace sqslam
