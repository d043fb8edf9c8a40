#pragma once

#include <opencv2/core.hpp>

#include "slam/features/frame_features.h"
#include "slam/features/orb_extractor.h"
#include "slam/geometry/camera.h"

namespace sqslam {

struct SiftOptions {
  int num_features = 5000;  // keypoints per image
};

// Features for views that are far apart: SIFT (Lowe 2004) finds the same things from twice the distance and
// from 30 degrees aside, and takes thirty times as long as ORB. The largest keypoints are kept, as in COLMAP:
// they are found again more often than the strongest. Descriptors are 256 bits, so that everything that
// compares ORB's compares these too, but never one kind with the other: each bin of the histogram against the
// median and the upper quartile of all (Zhou et al. 2012, "Scalar quantization for large scale image
// search").
class SiftExtractor {
 public:
  explicit SiftExtractor(const SiftOptions& options) : options_(options) {}

  // `levels`: the octave of a keypoint is the one whose ORB keypoints are as large. `ignored`: 8UC1 of any
  // size, nonzero where keypoints are excluded; may be empty.
  FrameFeatures Extract(const cv::Mat& bgr, const Camera& camera, const ScaleLevels& levels,
                        const cv::Mat& ignored = {}) const;

  // Returns the features of any camera's image for Undistorted(): their `pixel` is the raw one.
  FrameFeatures ExtractRaw(const cv::Mat& bgr, const ScaleLevels& levels, const cv::Mat& ignored = {}) const;

 private:
  SiftOptions options_;
};

// Returns the features with undistorted pixels, without those out of reach (IsInReach).
FrameFeatures Undistorted(const FrameFeatures& raw, const Camera& camera);

}  // namespace sqslam
