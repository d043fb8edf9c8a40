#pragma once

#include <imgui.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/viewer/widgets/theme.h"

namespace sqslam::viewer {

struct PlotLine {
  std::string name;
  ImU32 color = 0;
  std::vector<double> values;  // one for each x
};

struct Plot {
  std::string title;      // with its unit
  std::vector<double> x;  // rising
  std::vector<PlotLine> lines;
  std::string x_name;
  const char* format = "{:.3g}";                   // of values, as fmt
  std::optional<double> now;                       // x of what is shown now, marked
  std::optional<std::pair<double, double>> range;  // of values; otherwise what the lines need
};

// Draws a small chart across the panel; the value under the mouse is told. Returns the index of the x that
// was clicked.
std::optional<std::size_t> DrawPlot(const Palette& palette, const char* id, const Plot& plot, float height);

}  // namespace sqslam::viewer
