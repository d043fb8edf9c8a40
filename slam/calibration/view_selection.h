#pragma once

#include <vector>

#include "slam/calibration/board.h"

namespace sqslam {

// The indices of at most `count` views that differ from one another the most, sharp ones first: in the
// board's place in the image, its size and its tilt both ways. Views like one that was chosen are left out,
// and so are those much blurrier than the rest.
std::vector<int> SelectViews(const std::vector<BoardView>& views, const CalibrationBoard& board,
                             cv::Size image, int count);

}  // namespace sqslam
