#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "slam/io/sequence.h"

namespace sqslam {

// Finds what moves with the camera: a car's bonnet, a robot's arm, a logo, a time stamp. There the images
// have the same gradients all the time, while the rest changes. `grays`: images of one size, in which the
// camera has moved far between two of them. Returns an 8UC1 mask of their size, nonzero in those regions;
// empty if there are none, or if the images do not change enough to tell.
cv::Mat FixedRegions(const std::vector<cv::Mat>& grays);

// Looks at images from all over the recording. Empty as well if it is shorter than two seconds or 16 images.
cv::Mat FindFixedRegions(const Sequence& sequence);

}  // namespace sqslam
