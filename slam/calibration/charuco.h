#pragma once

#include <opencv2/aruco/charuco.hpp>

#include "slam/calibration/board.h"

namespace sqslam {

// OpenCV's view of a checked ChArUco board, mm.
cv::Ptr<cv::aruco::CharucoBoard> MakeCharucoBoard(const CalibrationBoard& board);

}  // namespace sqslam
