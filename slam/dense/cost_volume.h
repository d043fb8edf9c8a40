#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "slam/dense/dense_options.h"
#include "slam/dense/patch_scores.h"

namespace sqslam {

// Depths between which a surface is looked for, map units.
struct DepthRange {
  double nearest = 0.0;
  double farthest = 0.0;
};

// Matching costs of a keyframe's pixels on planes in front of it, of even steps in inverse depth from the
// farthest (0) to the nearest: 0 for perfect agreement, 254 for none. The costs of a pixel lie side by side.
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

// The plane sweep (Collins 1996; Gallup et al., CVPR 2007, with planes parallel to the image).
CostVolume SweepPlanes(PatchScores& scores, const DepthRange& range, int planes);

// Planes found, one for each pixel.
struct PlaneMap {
  cv::Mat plane;  // 32FC1, between planes too; below 0: none
  cv::Mat cost;   // 8UC1, matching cost on the plane found
};

// Semi-global matching (Hirschmueller, PAMI 2008) along eight paths: the plane of the least sum of matching
// cost and of steps between neighbouring pixels, and from the costs of the planes next to it the place
// between them (parabola). `gray`: the keyframe (8UC1); steps are cheaper where it has an edge.
PlaneMap AggregateSemiGlobally(const CostVolume& volume, const cv::Mat& gray, const StereoOptions& options);

}  // namespace sqslam
