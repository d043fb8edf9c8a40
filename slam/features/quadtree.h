#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace sqslam {

// Keeps about `count` of the corners so that they cover the image evenly, as ORB-SLAM's extractor does
// (Mur-Artal et al. 2015, V-A, and its code): the area is split as a quadtree until it has `count` non-empty
// leaves, and the strongest corner of each leaf stays.
std::vector<cv::KeyPoint> DistributeByQuadtree(const std::vector<cv::KeyPoint>& corners, cv::Size area,
                                               int count);

}  // namespace sqslam
