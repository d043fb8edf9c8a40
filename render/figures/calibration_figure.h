#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "render/page/figure_options.h"

namespace sqslam {

// How a calibration fits: the error of each corner as an arrow at its place in the image, how often each part
// of the image was covered, and the distribution of the errors.
struct CalibrationFigure {
  struct Corner {
    Eigen::Vector2d pixel;
    Eigen::Vector2d error;  // found minus modelled, px
  };
  int width = 0;  // of the images, px
  int height = 0;
  std::vector<Corner> corners;
  double rms = 0.0;  // px
};

// Throws UsageError where the size leaves no room or there is no corner.
FigurePage DrawCalibration(const CalibrationFigure& figure, const FigureOptions& options);

// Black and white rectangles at true scale on a page with a margin: A4 where they fit on it, upright or
// across, otherwise a page of their own size. Lengths in mm.
struct BoardSheet {
  struct Area {
    FigureRect area;  // from the board's top-left corner
    bool black = true;
  };
  double width = 0.0;
  double height = 0.0;
  std::vector<Area> areas;
  std::string caption;  // below
};
FigurePage DrawBoardSheet(const BoardSheet& sheet, double dpi);

}  // namespace sqslam
