#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "render/page/figure_options.h"
#include "render/page/page.h"

namespace sqslam {

// An axis with round numbers at its ticks.
struct ChartAxis {
  double low = 0.0;
  double high = 1.0;
  double step = 0.2;  // between ticks

  // Returns the multiples of `step` in [low, high], the first thousand; none if `step` is lost in rounding.
  std::vector<double> Ticks() const;
  std::string TickText(double value) const;  // with as many decimals as the step needs

  // Returns the ticks that get a number: every one, every second, fifth, tenth, ..., so that numbers of
  // `room` points each do not touch on an axis of this length (points).
  std::vector<double> NumberedTicks(double length, double room) const;
};

// Makes an axis over [low, high] with about `ticks` ticks, but at least two. `whole_steps`: extends its ends
// to ticks.
ChartAxis RoundAxis(double low, double high, int ticks, bool whole_steps);

// The look that distinguishes the series of a chart: colours, and dashes and hatches for greyscale prints.
struct SeriesLook {
  Eigen::Vector3d color = Eigen::Vector3d::Zero();
  std::vector<double> dash;  // points
  int hatch = 0;             // 0: none; 1 to 4: rising, falling, level, crossed
};
SeriesLook LookOfSeries(std::size_t index);

// Draws a bar, with its hatch in the background colour.
void DrawBar(FigureSheet& sheet, const FigureRect& bar, const SeriesLook& look);

// Returns the lines of a hatch across a rectangle, in page coordinates, `spacing` points apart.
std::vector<std::pair<Eigen::Vector2d, Eigen::Vector2d>> HatchLines(const FigureRect& rect, int hatch,
                                                                    double spacing);

struct LegendEntry {
  std::string text;
  std::function<void(FigureSheet& sheet, const FigureRect& box)> draw_sign;  // beside the text

  static LegendEntry Bar(std::string text, const SeriesLook& look);
  static LegendEntry Line(std::string text, const FigureStroke& stroke);
  // Draws a mark at a point of the page.
  static LegendEntry Mark(std::string text,
                          std::function<void(FigureSheet& sheet, const Eigen::Vector2d& center)> draw_mark);
};

// Entries are set in centred lines of at most the given width. Points.
double LegendHeight(const std::vector<LegendEntry>& entries, double width, const FigureTheme& theme);
void DrawLegend(FigureSheet& sheet, const std::vector<LegendEntry>& entries, const FigureRect& area);

// Makes a page with a legend above the area that is left (MakeSheet).
FigureSheet MakeChartSheet(const FigureOptions& options, double own_width, const std::string& description,
                           const std::vector<LegendEntry>& legend, double gap_below_legend,
                           const std::function<double(double width, const FigureTheme& theme)>& own_height);

// A part of a page with two axes.
struct PlotArea {
  FigureRect area;
  ChartAxis x;
  ChartAxis y;

  double X(double value) const { return area.x + (value - x.low) / (x.high - x.low) * area.width; }
  double Y(double value) const { return area.Bottom() - (value - y.low) / (y.high - y.low) * area.height; }
  Eigen::Vector2d At(double x_value, double y_value) const { return {X(x_value), Y(y_value)}; }
};

// Draw one axis each: numbers, the label outside them, and grid lines (across x if `grid` is set).
void DrawXAxis(FigureSheet& sheet, const PlotArea& plot, const std::string& label, bool grid = true);
void DrawYAxis(FigureSheet& sheet, const PlotArea& plot, const std::string& label);

// Return the room that numbers and label of an axis take beside the plot, points.
double XAxisHeight(const FigureTheme& theme);
double YAxisWidth(const ChartAxis& axis, const FigureTheme& theme);

}  // namespace sqslam
