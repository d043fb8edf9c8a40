#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "slam/features/corners.h"
#include "slam/features/frame_features.h"
#include "slam/geometry/camera.h"

namespace sqslam {

struct OrbOptions {
  int num_features = 1000;     // keypoints per image
  double scale_factor = 1.2;   // ratio of the sizes of adjacent pyramid levels
  int levels = 8;              // pyramid levels
  int fast_threshold = 20;     // grey levels, tried first in each cell
  int min_fast_threshold = 7;  // grey levels, tried in cells that would stay empty

  void VisitFields(auto&& visit) {
    visit("num_features", num_features, 100, 10000);
    visit("scale_factor", scale_factor, 1.05, 2.0);
    visit("levels", levels, 1, 12);
    visit("fast_threshold", fast_threshold, 2, 100);
    visit("min_fast_threshold", min_fast_threshold, 1, 100);
  }
};

// Sizes and uncertainties of the pyramid levels.
class ScaleLevels {
 public:
  explicit ScaleLevels(const OrbOptions& options);
  int Count() const { return static_cast<int>(scales_.size()); }
  double Factor() const { return factor_; }
  double Scale(int octave) const { return scales_[octave]; }
  // Variance of a keypoint's position in full-resolution pixels^2, relative to level 0.
  double Variance(int octave) const { return Scale(octave) * Scale(octave); }

  // Returns the standard deviation of a keypoint's position, full-resolution px.
  double Sigma(const Keypoint& keypoint) const { return Scale(keypoint.octave) * keypoint.sigma; }

  // Returns the level at which a point should be seen at `distance`, if level 0 sees it up to
  // `level_zero_distance`.
  int PredictOctave(double distance, double level_zero_distance) const;

 private:
  double factor_;
  double log_factor_;
  std::vector<double> scales_;
};

// ORB features spread evenly over the image and over the scales: FAST with a threshold that adapts to each
// cell, the strongest corner of each quadtree leaf, orientation by intensity centroid, steered BRIEF. Reuses
// its buffers between images: one extractor per thread.
class OrbExtractor {
 public:
  explicit OrbExtractor(const OrbOptions& options);

  // `ignored`: 8UC1 of the image's size, nonzero where keypoints are excluded; may be empty.
  FrameFeatures Extract(const cv::Mat& gray, const cv::Mat& bgr, const Camera& camera,
                        const cv::Mat& ignored = {});

 private:
  std::vector<cv::KeyPoint> DetectLevel(std::size_t octave, const cv::Mat& ignored);
  void ExtractLevel(std::size_t octave, double scale, const cv::Mat& bgr, const Camera& camera,
                    const cv::Mat& ignored, FrameFeatures& features, std::vector<KeypointPatch>& patches);

  OrbOptions options_;
  std::vector<int> features_per_level_;
  std::vector<cv::Mat> levels_;
  std::vector<cv::Mat> blurred_;
  CornerDetector detector_;
};

}  // namespace sqslam
