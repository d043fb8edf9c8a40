#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

#include "slam/calibration/board.h"
#include "slam/geometry/camera.h"
#include "slam/geometry/rigid3.h"

namespace sqslam::testing {

// Renders a printed board, with several rays per pixel.
class BoardScene {
 public:
  BoardScene(const CalibrationBoard& board, const Camera& camera);

  // 8UC3. T_camera_board: mm; the board lies in z = 0 with its top-left corner at the origin, x right, y
  // down.
  cv::Mat Render(const Rigid3d& T_camera_board) const;

 private:
  Camera camera_;
  cv::Mat paper_;
  std::vector<Eigen::Vector2f> rays_;  // x and y at z = 1
};

// Returns poses all over the image and tilted to all sides, determined by the index. With a reach above 1 the
// board extends beyond the image in its corners.
Rigid3d BoardPose(const CalibrationBoard& board, const Camera& camera, int index, double reach = 1.0);

}  // namespace sqslam::testing
