#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "slam/dense/dense_options.h"
#include "slam/dense/patch_scores.h"
#include "slam/dense/view_choice.h"

namespace sqslam {

struct StereoDepth {
  cv::Mat depth;  // 32FC1, map units, 0 if unknown
  cv::Mat sigma;  // 32FC1, predicted standard deviation of the depth, share of it
};

// Estimates the depth of a keyframe's pixels from two or more views: plane sweep, semi-global aggregation,
// then refinement with the wider `fine_views`, in which patches follow the slope of the surface. The standard
// deviation follows from the curvature of the scores about their top, and from the error of the poses in
// pixels. Takes about 400 bytes per pixel.
StereoDepth EstimateDepth(const StereoView& keyframe, const std::vector<StereoView>& views,
                          const std::vector<StereoView>& fine_views, const Camera& camera,
                          const DepthRange& range, const StereoOptions& options);

// The plane found for each pixel.
struct PlaneMap {
  cv::Mat plane;  // 32FC1, may lie between planes
  cv::Mat cost;   // 8UC1, matching cost on the plane found
};

// Semi-global matching (Hirschmueller, PAMI 2008) along eight paths: minimizes the sum of matching costs and
// of penalties for steps between neighbouring pixels, then refines the plane by a parabola. `costs`: 8 bit
// with a channel for each plane. `gray`: the keyframe (8UC1); large steps cost less at its edges.
PlaneMap AggregateSemiGlobally(const cv::Mat& costs, const cv::Mat& gray, const StereoOptions& options);

}  // namespace sqslam
