#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "slam/calibration/board.h"
#include "slam/geometry/camera.h"

namespace sqslam {

struct CalibrationOptions {
  int max_views = 40;             // that the calibration is made of
  double max_view_error = 2.5;    // RMS error of a view above which it is dropped, in units of their median
  double max_corner_error = 5.0;  // error of a corner above which it is dropped, robust standard deviations

  void VisitFields(auto&& visit) {
    visit("max_views", max_views, 3, 1000);
    visit("max_view_error", max_view_error, 1.0, 1000.0);
    visit("max_corner_error", max_corner_error, 1.0, 1000.0);
  }
};

// A view as the calibration sees it.
struct CalibratedView {
  std::string name;
  std::vector<Eigen::Vector2d> pixels;  // of the corners that were kept, as found
  std::vector<Eigen::Vector2d> errors;  // found minus where the model has them, px
  Eigen::Vector3d normal;               // of the board, camera frame, towards the camera
  double rms = 0.0;                     // px, over both coordinates together
};

struct Calibration {
  Camera camera;
  std::array<double, 4> intrinsic_deviation{};   // of fx, fy, cx, cy; px
  std::array<double, 5> distortion_deviation{};  // 0 where a coefficient was left out
  double rms = 0.0;                              // px
  std::vector<CalibratedView> views;
  std::vector<std::string> dropped_views;  // names, with their error
  int dropped_corners = 0;
  double covered = 0.0;  // share of the image inside the hull of all corners
  double tilt = 0.0;     // largest angle between two boards, radians
  bool folds = false;    // rays farther out show farther in, somewhere within the image
};

// Zhang's method (OpenCV) on the chosen views, made robust: views and corners that do not fit are dropped and
// the rest calibrated again, and the third radial coefficient is left out where the views do not tell it or
// where it would fold the image's corners. Throws InputError where fewer than three views are left or nothing
// fits.
Calibration Calibrate(const std::vector<BoardView>& views, const CalibrationBoard& board, cv::Size image,
                      const CalibrationOptions& options);

// Reasons to distrust a calibration, for people: poor coverage, boards nearly parallel, few views, large
// errors, a lens model that folds.
std::vector<std::string> Weaknesses(const Calibration& calibration);

}  // namespace sqslam
