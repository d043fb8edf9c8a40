#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "slam/geometry/box2.h"

namespace sqslam {

// Tracks boxes through the images between two that a detector has looked at. `images` (8UC1, all of one size)
// begin with the one that shows `first` and end with the one that shows `last`.
//
// Each box of the first image is carried from image to image by the corners in it (pyramidal Lucas-Kanade,
// there and back): it moves and grows as they do in the median. Where it arrives on a box of its class in the
// last image, it is what the detector would have seen on the way, once the rest of the way is spread over the
// images; otherwise one of the two is wrong and it is left out. Boxes without texture go straight from one
// place to the other if these overlap.
//
// Returns the boxes of images 1 to N - 2, those of an image in the order of `first`.
std::vector<std::vector<Detection>> TrackBoxes(const std::vector<cv::Mat>& images,
                                               const std::vector<Detection>& first,
                                               const std::vector<Detection>& last);

}  // namespace sqslam
