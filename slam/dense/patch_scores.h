#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/geometry/rigid3.h"

namespace sqslam {

// An image for stereo, with its pose. All images of a set share one camera, without distortion.
struct StereoView {
  cv::Mat gray;  // 8UC1
  Rigid3d T_map_camera;
};

// Compares patches around a keyframe's pixels with other views at given inverse depths: zero-mean normalised
// cross-correlation (ZNCC) over 5x5 pixels, with the noise variance added to both variances. The score is the
// mean of the best two views, because a surface may be occluded in some.
//
// Each pixel of a patch is projected at its own inverse depth: patches follow slanted and curved surfaces as
// far as the given inverse depths do.
class PatchScores {
 public:
  // `views`: two or more. `noise`: standard deviation of the images' noise, grey levels.
  PatchScores(const StereoView& keyframe, const std::vector<StereoView>& views, const Camera& camera,
              double noise);

  // Returns each pixel's score in [-1, 1] (32FC1) at its inverse depth (32FC1, 1 / map units). A pixel
  // outside a view scores -1 there.
  cv::Mat At(const cv::Mat& inverse_depth);
  cv::Size Size() const { return value_.size(); }

 private:
  struct View {
    std::vector<std::uint32_t> corners;  // grey values of each pixel and of those right, below and diagonal
    Eigen::Matrix3f H_0;                 // pixel of the keyframe at infinity -> homogeneous pixel of the view
    Eigen::Vector3f epipole;             // added to it per unit of inverse depth
  };

  void ScoreView(const View& view, const cv::Mat& inverse_depth, cv::Mat& best, cv::Mat& second);

  float noise_;            // of a whole patch: noise variance times its pixels
  cv::Mat keyframe_;       // 32FC1, grey values minus a middle grey
  cv::Mat mean_;           // 32FC1, of the patches
  cv::Mat inverse_sigma_;  // 32FC1, 1 / square root of the patches' sums of squared deviations
  std::vector<View> views_;
  cv::Mat value_;   // 32FC1, the view's grey values at the keyframe's pixels, minus a middle grey
  cv::Mat inside_;  // 32FC1, 1 where the pixel falls into the view, else 0
};

}  // namespace sqslam
