#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "slam/geometry/box2.h"

namespace sqslam {

// Tracks boxes through the images between two that a detector has processed. `images` (8UC1, all of one size)
// begin with that of `first` and end with that of `last`.
//
// Each box of the first image is carried from image to image by the corners in it (pyramidal Lucas-Kanade
// with forward-backward check): it takes their median shift and growth. If it arrives at a box of its class
// in the last image, the remaining error is spread over the images; otherwise one of the two boxes is wrong
// and it is dropped. Boxes without texture are interpolated linearly if the two overlap.
//
// Returns the boxes of images 1 to N - 2, those of an image in the order of `first`.
std::vector<std::vector<Detection>> TrackBoxes(const std::vector<cv::Mat>& images,
                                               const std::vector<Detection>& first,
                                               const std::vector<Detection>& last);

}  // namespace sqslam
