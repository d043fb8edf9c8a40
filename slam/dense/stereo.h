#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "slam/dense/cost_volume.h"
#include "slam/dense/dense_options.h"
#include "slam/dense/patch_scores.h"

namespace sqslam {

// Returns the depth of a keyframe's pixels (32FC1, map units, 0 if unknown) from two or more views: plane
// sweep, semi-global aggregation, then refinement with the wider `fine_views`, in which patches follow the
// slope of the surface. Takes about 400 bytes per pixel.
cv::Mat EstimateDepth(const StereoView& keyframe, const std::vector<StereoView>& views,
                      const std::vector<StereoView>& fine_views, const Camera& camera,
                      const DepthRange& range, const StereoOptions& options);

}  // namespace sqslam
