#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "slam/calibration/board.h"

namespace sqslam {

// A board as one image shows it.
struct BoardView {
  std::string name;                  // of the image or frame, for messages
  std::vector<int> ids;              // of the corners that were found, into BoardCorners()
  std::vector<cv::Point2f> corners;  // px, distorted
  double sharpness = 0.0;  // steepness of the edges at the corners: 0.5 where black turns white within
                           // a pixel, less the more they are blurred
};

// Finds the board, or enough of it for a view (a chessboard must be seen whole). `gray`: 8UC1.
std::optional<BoardView> FindBoard(const cv::Mat& gray, const CalibrationBoard& board);

}  // namespace sqslam
