#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace sqslam {

// Keeps about `count` of the corners so that they cover the image evenly: the area is split as a quadtree
// until it has `count` non-empty leaves, and the strongest corner of each leaf stays.
std::vector<cv::KeyPoint> SpreadCorners(const std::vector<cv::KeyPoint>& corners, cv::Size area, int count);

}  // namespace sqslam
