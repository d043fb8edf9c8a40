#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "slam/geometry/box2.h"

namespace sqslam {

// Tracks boxes through the images between two that a detector has processed: `first` are the boxes of the
// first and `last` the boxes of the last of the N `images` (8UC1, all of one size).
//
// Each box of the first image is moved from image to image by the median shift and growth of the corners in
// it (pyramidal Lucas-Kanade with forward-backward check). If it ends at a box of its class in the last
// image, the remaining error is spread over the images; otherwise it is dropped, since one of the two boxes
// is wrong. Boxes without texture are interpolated linearly if the two overlap.
//
// Returns the boxes of images 1 to N - 2, for each image in the order of `first`.
std::vector<std::vector<Detection>> TrackBoxes(const std::vector<cv::Mat>& images,
                                               const std::vector<Detection>& first,
                                               const std::vector<Detection>& last);

}  // namespace sqslam
