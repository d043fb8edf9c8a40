#pragma once

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
};

// Makes an axis over [low, high] with about `ticks` ticks. `whole_steps`: extends its ends to ticks.
ChartAxis RoundAxis(double low, double high, int ticks, bool whole_steps);

// The look that distinguishes the series of a chart: colours, and dashes and hatches for greyscale prints.
struct SeriesLook {
  Eigen::Vector3d color = Eigen::Vector3d::Zero();
  std::vector<double> dash;  // points
  int hatch = 0;             // 0: none; 1 to 4: rising, falling, level, crossed
};
SeriesLook LookOfSeries(std::size_t index);

// Draws a bar; a hatch is drawn as `stripes` in the background colour.
void DrawBar(FigurePage& page, const FigureRect& bar, const SeriesLook& look, const Eigen::Vector3d& stripes);

// Returns the lines of a hatch across a rectangle, in page coordinates, `spacing` points apart.
std::vector<std::pair<Eigen::Vector2d, Eigen::Vector2d>> HatchLines(const FigureRect& rect, int hatch,
                                                                    double spacing);

struct Mark {
  enum class Shape { kCircle, kDiamond, kCross };
  Shape shape = Shape::kCircle;
  double size = 4.0;  // points
  Eigen::Vector3d color = Eigen::Vector3d::Zero();
};
void DrawMark(FigurePage& page, const Eigen::Vector2d& center, const Mark& mark);

// Returns the corners of a regular polygon, the first one at angle `first` (radians).
std::vector<Eigen::Vector2d> RegularPolygon(const Eigen::Vector2d& center, int corners, double radius,
                                            double first = 0.0);

struct LegendEntry {
  enum class Kind { kBar, kLine, kMark, kTick };
  std::string text;
  Kind kind = Kind::kBar;
  SeriesLook look;
  double width = 1.2;  // of a line, points
  Mark mark{};

  static LegendEntry Bar(std::string text, SeriesLook look) { return {std::move(text), Kind::kBar, look}; }
  static LegendEntry Line(std::string text, const FigureStroke& stroke) {
    return {std::move(text), Kind::kLine, {stroke.color, stroke.dash, 0}, stroke.width};
  }
  static LegendEntry OfMark(std::string text, const Mark& mark) {
    return {std::move(text), Kind::kMark, {}, 0.0, mark};
  }
  static LegendEntry Tick(std::string text, const FigureStroke& stroke) {
    return {std::move(text), Kind::kTick, {stroke.color, {}, 0}, stroke.width};
  }
};

// Entries are set in centred lines of at most the given width. Points.
double LegendHeight(const std::vector<LegendEntry>& entries, double width, const FigureTheme& theme);
void DrawLegend(FigurePage& page, const std::vector<LegendEntry>& entries, const FigureRect& area,
                const FigureTheme& theme);

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
void DrawXAxis(FigurePage& page, const PlotArea& plot, const std::string& label, const FigureTheme& theme,
               bool grid = true);
void DrawYAxis(FigurePage& page, const PlotArea& plot, const std::string& label, const FigureTheme& theme);

// Return the room that numbers and label of an axis take beside the plot, points.
double XAxisHeight(const FigureTheme& theme);
double YAxisWidth(const ChartAxis& axis, const FigureTheme& theme);

// Matplotlib's viridis (van der Walt and Smith, 2015) for values in [0, 1], clamped. It is perceptually
// uniform, also for colour-blind people and in greyscale.
Eigen::Vector3d Viridis(double value);

// A colour bar over the axis, with numbers below and their meaning at the left. If `limit` lies on the axis,
// it is marked with a line and named at the right end.
struct ColorBar {
  ChartAxis axis;
  std::string meaning;
  double limit = 0.0;
  std::string limit_meaning;
};
double ColorBarHeight(const FigureTheme& theme);
void DrawColorBar(FigurePage& page, const ColorBar& bar, const FigureRect& area, const FigureTheme& theme);

}  // namespace sqslam
