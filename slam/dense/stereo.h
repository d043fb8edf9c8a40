#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "slam/dense/cost_volume.h"
#include "slam/dense/dense_options.h"
#include "slam/dense/patch_scores.h"

namespace sqslam {

// Depth of a keyframe's pixels (32FC1, map units, 0 where nothing is found) from two or more views: the plane
// sweep, semi-global aggregation, and rounds of finer steps in which patches take on the slope of the surface
// found, with views of larger angles. Takes about 400 bytes a pixel meanwhile.
cv::Mat EstimateDepth(const StereoView& keyframe, const std::vector<StereoView>& views,
                      const std::vector<StereoView>& fine_views, const Camera& camera,
                      const DepthRange& range, const StereoOptions& options);

}  // namespace sqslam
