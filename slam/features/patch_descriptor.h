#pragma once

#include <opencv2/core.hpp>

#include "slam/features/frame_features.h"

namespace sqslam {

inline constexpr int kPatchRadius = 15;  // reach of orientation and descriptor, pixels of the level

// Returns the direction from a round patch's centre to its intensity centroid (Rosin 1999), degrees in
// [0, 360), from +x towards +y. `image` is 8 bit; `center` is at least kPatchRadius + 1 pixels from its
// edges.
float PatchAngle(const cv::Mat& image, const cv::Point& center);

// Smooths a level for descriptors: Gaussian of 7x7 pixels, sigma 2, mirrored borders. Reuses the memory of
// `blurred` if the size is unchanged.
void BlurForDescriptors(const cv::Mat& image, cv::Mat& blurred);

// Computes steered BRIEF (Rublee et al. 2011), bit-identical to cv::ORB on the same blurred image: the
// pattern is rotated by `angle` degrees and rounded to integer pixels. `center` is at least kBriefReach
// pixels from the edges of `blurred`, which is 8 bit.
Descriptor DescribePatch(const cv::Mat& blurred, const cv::Point& center, float angle);

}  // namespace sqslam
