#pragma once

#include <Eigen/Geometry>
#include <opencv2/core/types.hpp>
#include <vector>

namespace sqslam {

// Marks square tiles of a picture, to draw what is costly only there. For the sources of render/gl only.
class ScreenTiles {
 public:
  static constexpr int kSide = 16;  // pixels of the picture

  explicit ScreenTiles(cv::Size picture);

  // Marks all tiles that this part of the picture touches; pixels from the lower left.
  void Mark(const Eigen::AlignedBox2d& pixels);

  // Returns rectangles, pixels from the lower left, that together are the marked tiles, or all others.
  // `step`: pixels of the picture per pixel of the target that they are for; divides kSide.
  std::vector<cv::Rect> Areas(bool marked, int step = 1) const;

 private:
  cv::Size picture_;
  cv::Size tiles_;
  std::vector<bool> marked_;  // row by row
};

// Returns a part of the picture that holds all that is seen of a box, pixels from the lower left.
// `T_device_box`: to OpenGL's clip coordinates.
Eigen::AlignedBox2d SeenPart(const Eigen::AlignedBox3d& box, const Eigen::Matrix4d& T_device_box,
                             cv::Size picture);

}  // namespace sqslam
