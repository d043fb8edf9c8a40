#pragma once

#include <Eigen/Core>

#include "render/page/chart.h"
#include "render/page/figure_options.h"

namespace sqslam {

// viridis of matplotlib (van der Walt and Smith, 2015) for values in [0, 1]: even steps look even, also to
// colour-blind eyes and in grey. Values beyond are clamped.
Eigen::Vector3d Viridis(double value);

// A bar of the ramp over the axis, numbers below, what they mean at the left. `limit`, where it lies on the
// axis, is marked with a line and named at the right end.
struct ColorBar {
  ChartAxis axis;
  std::string meaning;
  double limit = 0.0;
  std::string limit_meaning;
};
double ColorBarHeight(const FigureTheme& theme);
void DrawColorBar(FigurePage& page, const ColorBar& bar, const FigureRect& area, const FigureTheme& theme);

}  // namespace sqslam
