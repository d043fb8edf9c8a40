#pragma once

#include <opencv2/core.hpp>

#include "slam/features/frame_features.h"

namespace sqslam {

inline constexpr int kPatchRadius = 15;  // reach of orientation and descriptor, pixels of the level

// Direction from the centre of a round patch to its intensity centroid (Rosin 1999), degrees in [0, 360),
// from +x towards +y. `image` is 8 bit; `center` is at least kPatchRadius + 1 pixels from its edges.
float PatchAngle(const cv::Mat& image, const cv::Point& center);

// Smooths a level as descriptors want it: Gaussian of 7x7 pixels, sigma 2, the borders mirrored. `blurred`
// keeps its memory where the size stays.
void BlurForDescriptors(const cv::Mat& image, cv::Mat& blurred);

// Steered BRIEF (Rublee et al. 2011), equal bit by bit to that of cv::ORB on the same blurred image: the
// pattern is turned by `angle` degrees and rounded to whole pixels. `center` is at least kBriefReach pixels
// from the edges of `blurred`, which is 8 bit.
Descriptor DescribePatch(const cv::Mat& blurred, const cv::Point& center, float angle);

}  // namespace sqslam
