#pragma once

#include <Eigen/Core>
#include <array>
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

  int Width() const { return width_; }
  int Height() const { return height_; }

  // Calls `row(y, scores)` for each row from the top, with a score in [-1, 1] for each pixel.
  // `inverse_depth(y)` returns the row's inverse depths in 1 / map units (Width() of them, valid until the
  // next call). A pixel outside a view scores -1 there.
  template <typename InverseDepth, typename Row>
  void Visit(const InverseDepth& inverse_depth, const Row& row) {
    Restart();
    for (int y = 0; y < height_; ++y) {
      Take(y, inverse_depth(y));
      if (y >= kRadius) {
        row(y - kRadius, Scores(y - kRadius));
      }
    }
    for (int y = height_; y < height_ + kRadius; ++y) {  // replicates the last row below the image
      Take(y, nullptr);
      row(y - kRadius, Scores(y - kRadius));
    }
  }

 private:
  static constexpr int kRadius = 2;
  static constexpr int kRows = 2 * kRadius + 1;

  // A view, with column sums of the patches around the current row.
  struct View {
    std::vector<std::uint32_t>
        corners;              // grey values of each pixel and of its right, lower and lower right neighbour
    Eigen::Matrix3f H_0;      // pixel of the keyframe at infinity -> homogeneous pixel of the view
    Eigen::Vector3f epipole;  // added to it per unit of inverse depth
    std::array<std::vector<float>, kRows> value, square, product;  // of the last rows
    std::array<std::vector<float>, kRows> inside;  // 1 where the pixel falls into the view, else 0
    std::vector<float> values, squares, products;  // column sums, padded by two on each side
  };

  void Restart();
  void Take(int y, const float* inverse_depth);
  void Sample(View& view, int y, int slot, const float* inverse_depth);
  const float* Scores(int y);

  int width_;
  int height_;
  float noise_;            // of a whole patch: noise variance times its pixels
  cv::Mat keyframe_;       // 32FC1, minus kMiddle
  cv::Mat mean_;           // 32FC1, of the patches
  cv::Mat inverse_sigma_;  // 32FC1, 1 / square root of the patches' sums of squared deviations
  std::vector<View> views_;
  std::vector<float> columns_;  // 0, 1, 2, ...
  std::vector<std::int32_t> places_;
  std::vector<float> right_, down_;
  std::vector<std::uint32_t> found_;
  std::vector<float> best_, second_, score_;
};

}  // namespace sqslam
