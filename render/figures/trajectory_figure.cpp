#include <algorithm>
#include <cmath>
#include <limits>

#include "render/figures/chart_figures.h"
#include "render/page/chart.h"
#include "render/page/panels.h"
#include "slam/util/error.h"

namespace sqslam {
namespace {

constexpr double kTruthWidth = 2.6;  // points; the estimates are drawn over it
constexpr double kPathWidth = 1.1;
constexpr double kTrajectoryGap = 5.0;

struct Bounds {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector3d high = -low;
  double first_time = std::numeric_limits<double>::infinity();
  double last_time = -first_time;

  void Add(const TrajectoryFigure::Pieces& pieces) {
    for (const auto& piece : pieces) {
      for (const TrajectoryFigure::Pose& pose : piece) {
        low = low.cwiseMin(pose.position);
        high = high.cwiseMax(pose.position);
        first_time = std::min(first_time, pose.time);
        last_time = std::max(last_time, pose.time);
      }
    }
  }
};

Bounds BoundsOf(const TrajectoryFigure& figure) {
  Bounds bounds;
  if (figure.truth) {
    bounds.Add(figure.truth->pieces);
  }
  for (const TrajectoryFigure::Path& path : figure.paths) {
    bounds.Add(path.pieces);
  }
  if (!bounds.low.allFinite()) {
    throw UsageError("no camera path to draw, expected at least one pose");
  }
  const double size = std::max((bounds.high - bounds.low).maxCoeff(), 1e-6);
  const Eigen::Vector3d least = Eigen::Vector3d::Constant(0.1 * size);  // a straight path still gets a plot
  const Eigen::Vector3d missing =
      0.5 * (least - (bounds.high - bounds.low)).cwiseMax(0.0) + Eigen::Vector3d::Constant(0.05 * size);
  bounds.low -= missing;
  bounds.high += missing;
  return bounds;
}

FigureStroke TruthStroke(const FigureTheme& theme) {
  return {0.5 * theme.muted + 0.5 * theme.faint, kTruthWidth, {}};
}

std::vector<LegendEntry> LegendOf(const TrajectoryFigure& figure, const FigureTheme& theme) {
  std::vector<LegendEntry> entries;
  const auto line = [&entries](const std::string& name, const FigureStroke& stroke) {
    LegendEntry entry;
    entry.kind = LegendEntry::Kind::kLine;
    entry.text = name;
    entry.look.color = stroke.color;
    entry.look.dash = stroke.dash;
    entry.width = stroke.width;
    entry.mark.size = 0.0;
    entries.push_back(entry);
  };
  if (figure.truth) {
    line(figure.truth->name, TruthStroke(theme));
  }
  for (std::size_t i = 0; i < figure.paths.size(); ++i) {
    const SeriesLook look = LookOfSeries(static_cast<int>(i));
    line(figure.paths[i].name, {look.color, kPathWidth, look.dash});
  }
  LegendEntry start;
  start.kind = LegendEntry::Kind::kMark;
  start.text = "start";
  start.mark = {Mark::Shape::kCircle, 5.0, theme.ink};
  entries.push_back(start);
  return entries;
}

// A path in the plot, by what of a pose goes right and up.
template <typename Across, typename Upwards>
void DrawPieces(FigurePage& page, const PlotArea& plot, const TrajectoryFigure::Pieces& pieces,
                const FigureStroke& stroke, Across&& across, Upwards&& upwards) {
  constexpr double kFinest = 0.1;  // points; what is finer cannot be seen and only makes the file larger
  for (const auto& piece : pieces) {
    std::vector<Eigen::Vector2d> points;
    for (std::size_t i = 0; i < piece.size(); ++i) {
      const Eigen::Vector2d p = plot.At(across(piece[i]), upwards(piece[i]));
      if (points.empty() || i + 1 == piece.size() || (p - points.back()).norm() > kFinest) {
        points.push_back(p);
      }
    }
    page.Polyline(std::move(points), stroke);
  }
}

template <typename Across, typename Upwards>
void DrawPaths(FigurePage& page, const PlotArea& plot, const TrajectoryFigure& figure,
               const FigureTheme& theme, Across&& across, Upwards&& upwards) {
  if (figure.truth) {
    DrawPieces(page, plot, figure.truth->pieces, TruthStroke(theme), across, upwards);
  }
  for (std::size_t i = 0; i < figure.paths.size(); ++i) {
    const SeriesLook look = LookOfSeries(static_cast<int>(i));
    DrawPieces(page, plot, figure.paths[i].pieces, {look.color, kPathWidth, look.dash}, across, upwards);
  }
  for (const TrajectoryFigure::Path& path : figure.paths) {
    if (!path.pieces.empty() && !path.pieces.front().empty()) {
      const TrajectoryFigure::Pose& first = path.pieces.front().front();
      DrawMark(page, plot.At(across(first), upwards(first)), {Mark::Shape::kCircle, 5.0, theme.ink});
    }
  }
}

struct TrajectoryLayout {
  FigureRect above;    // plot of x and y
  FigureRect heights;  // plot of z; empty: none
  FigureRect legend;
};

double HeightsBlock(const FigureTheme& theme) { return 60.0 + XAxisHeight(theme, true) + kTrajectoryGap; }

// What stands above and below the plot of x and y, in points.
double AroundPlot(const TrajectoryFigure& figure, const FigureTheme& theme, double width) {
  return LegendHeight(LegendOf(figure, theme), width, theme) + kTrajectoryGap + XAxisHeight(theme, true) +
         (figure.heights ? HeightsBlock(theme) : 0.0);
}

double LeftRoom(const ChartAxis& y, const FigureTheme& theme) { return YAxisWidth(y, theme, true) + 2.0; }

// Both axes at one scale, filling the area: the shorter range is widened.
PlotArea EqualAxes(const FigureRect& area, const Bounds& bounds) {
  const Eigen::Vector2d size = (bounds.high - bounds.low).head<2>();
  const double scale = std::min(area.width / size.x(), area.height / size.y());
  const Eigen::Vector2d middle = 0.5 * (bounds.high + bounds.low).head<2>();
  const Eigen::Vector2d half = 0.5 * Eigen::Vector2d(area.width, area.height) / scale;
  PlotArea plot;
  plot.area = area;
  constexpr double kTickSpacing = 28.0;  // points, about; the same for both axes: square cells
  const double step = RoundAxis(0.0, kTickSpacing / scale, 1, false).step;
  plot.x = {middle.x() - half.x(), middle.x() + half.x(), step};
  plot.y = {middle.y() - half.y(), middle.y() + half.y(), step};
  return plot;
}

void DrawHeights(FigurePage& page, const FigureRect& area, const TrajectoryFigure& figure,
                 const Bounds& bounds, const FigureTheme& theme) {
  PlotArea plot;
  plot.area = area;
  const double duration = bounds.last_time - bounds.first_time;
  plot.x = RoundAxis(-0.02 * duration, 1.02 * duration, std::max(2, int(area.width / 35.0)), false);
  plot.y = RoundAxis(bounds.low.z(), bounds.high.z(), std::max(2, int(area.height / 14.0)), false);
  DrawXAxis(page, plot, "time [s]", theme);
  DrawYAxis(page, plot, "z [" + figure.unit + "]", theme);
  const double start = bounds.first_time;
  DrawPaths(
      page, plot, figure, theme, [start](const TrajectoryFigure::Pose& pose) { return pose.time - start; },
      [](const TrajectoryFigure::Pose& pose) { return pose.position.z(); });
}

}  // namespace

FigurePage DrawTrajectories(const TrajectoryFigure& figure, const FigureOptions& options) {
  const Bounds bounds = BoundsOf(figure);
  FigureSheet sheet = MakeSheet(options, kColumnWidth, "Camera path", [&](double width) {
    const FigureTheme theme(options);
    const Eigen::Vector2d size = (bounds.high - bounds.low).head<2>();
    const double plot_width = width - 3.5 * theme.font;
    return AroundPlot(figure, theme, width) + plot_width * std::clamp(size.y() / size.x(), 0.35, 1.1);
  });
  const FigureTheme& theme = sheet.theme;
  const FigureRect& area = sheet.area;
  const double around = AroundPlot(figure, theme, area.width);
  const double plot_height = area.height - around;
  if (plot_height < 20.0) {
    throw UsageError("the figure is too low for its plot, expected a larger height");
  }
  const std::vector<LegendEntry> entries = LegendOf(figure, theme);
  const double legend = LegendHeight(entries, area.width, theme);
  DrawLegend(sheet.page, entries, {area.x, area.y, area.width, legend}, theme);
  // The room for the numbers depends on the axis, and that on the room: the widest number decides.
  FigureRect above{area.x, area.y + legend + kTrajectoryGap, area.width - 6.0, plot_height};
  const double left = LeftRoom(EqualAxes(above, bounds).y, theme);
  above.x += left;
  above.width -= left;
  const PlotArea plot = EqualAxes(above, bounds);
  DrawXAxis(sheet.page, plot, "x [" + figure.unit + "]", theme);
  DrawYAxis(sheet.page, plot, "y [" + figure.unit + "]", theme);
  DrawPaths(
      sheet.page, plot, figure, theme, [](const TrajectoryFigure::Pose& pose) { return pose.position.x(); },
      [](const TrajectoryFigure::Pose& pose) { return pose.position.y(); });
  if (figure.heights) {
    const double top = above.Bottom() + XAxisHeight(theme, true) + 1.6 * kTrajectoryGap;
    DrawHeights(sheet.page, {above.x, top, above.width, area.Bottom() - XAxisHeight(theme, true) - top},
                figure, bounds, theme);
  }
  return std::move(sheet.page);
}

}  // namespace sqslam
