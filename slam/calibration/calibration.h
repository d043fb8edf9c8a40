#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "slam/calibration/board.h"
#include "slam/geometry/camera.h"

namespace sqslam {

// A view in a calibration.
struct CalibratedView {
  std::string name;
  std::vector<Eigen::Vector2d> pixels;  // of the kept corners, as found
  std::vector<Eigen::Vector2d> errors;  // found minus projected, px
  Eigen::Vector3d normal;               // of the board, camera frame, towards the camera
  double rms = 0.0;                     // px, over both coordinates together
};

struct Calibration {
  Camera camera;
  std::array<double, 4> intrinsic_deviation{};   // of fx, fy, cx, cy; px
  std::array<double, 5> distortion_deviation{};  // 0 if a coefficient was left out
  double rms = 0.0;                              // px
  std::vector<CalibratedView> views;
  std::vector<std::string> dropped_views;  // names, with their error
  int dropped_corners = 0;
  double covered = 0.0;  // share of the image inside the hull of all corners
  double tilt = 0.0;     // largest angle between two boards, radians
  bool folds = false;    // the distortion folds within the image: rays farther out appear farther in
};

// Zhang's method (OpenCV) on a choice of views, made robust: drops outlier views and corners and calibrates
// again, and leaves out the third radial coefficient if the views don't determine it or if it would fold the
// image's corners. Throws InputError if fewer than three views are left or nothing fits.
Calibration Calibrate(const std::vector<BoardView>& views, const CalibrationBoard& board, cv::Size image);

// Returns reasons to distrust a calibration, as messages: poor coverage, nearly parallel boards, few views,
// large errors, a lens model that folds.
std::vector<std::string> Weaknesses(const Calibration& calibration);

}  // namespace sqslam
