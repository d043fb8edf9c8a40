#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "render/figures/figure_input.h"
#include "render/figures/figures.h"
#include "render/page/chart.h"
#include "render/picture/picture_text.h"
#include "slam/util/throw_if.h"

namespace sqslam {
namespace {

// From the palette of Okabe and Ito; the lightness differs, for greyscale prints.
Eigen::Vector3d YawAxisColor(int axis) {
  static constexpr std::array<const char*, 3> kColors = {"#d55e00", "#00a878", "#4aa8ff"};
  return ParseColor(kColors[static_cast<std::size_t>(axis)]);
}
constexpr std::array<const char*, 3> kAxisLetters = {"x", "y", "z"};
const Eigen::Vector3d kAxisHalo = Eigen::Vector3d::Ones();
const Eigen::Vector3d kLineRim = Eigen::Vector3d::Zero();
const Eigen::Vector3d kUnmatched = Eigen::Vector3d::Constant(0.72);

std::vector<LegendEntry> YawLegend() {
  std::vector<LegendEntry> entries;
  entries.push_back(LegendEntry::Line("unmatched line", {kUnmatched, 0.7, {}}));
  for (int axis = 0; axis < 3; ++axis) {
    entries.push_back(LegendEntry::Line(fmt::format("along {}", kAxisLetters[static_cast<std::size_t>(axis)]),
                                        {YawAxisColor(axis), 1.6, {}}));
  }
  return entries;
}

PanelGrid LayOutYaw(const YawFigure& figure, const FigureTheme& theme, double width) {
  PanelGrid grid = PanelGrid::Of(2, static_cast<int>(figure.objects.size()), width, 1.8 * theme.font);
  grid.top = 1.8 * theme.font;
  // The mean aspect ratio of the regions, so that little else is shown.
  double aspect = 0.0;
  for (const YawFigure::Object& object : figure.objects) {
    const double own = object.region.width / std::max(object.region.height, 1.0);
    aspect += (object.quarter_turns % 2 == 0 ? own : 1.0 / own) / static_cast<double>(figure.objects.size());
  }
  grid.height = grid.width / std::clamp(aspect, 0.75, 2.0);
  grid.texts = 1.7 * theme.small;
  grid.below = 0.4 * grid.gap + LegendHeight(YawLegend(), width, theme);
  return grid;
}

void DrawMatchedLines(FigurePage& page, const ImageCrop& crop, const YawFigure::View& view) {
  for (const bool matched : {false, true}) {
    for (const YawFigure::Line& line : view.lines) {
      if ((line.axis >= 0) == matched) {
        crop.DrawLine(page, line.from, line.to, {kLineRim, matched ? 1.5 : 0.9, {}});
        crop.DrawLine(page, line.from, line.to,
                      {matched ? YawAxisColor(line.axis) : kUnmatched, matched ? 1.0 : 0.45, {}});
      }
    }
  }
}

// Draws the axes as edges that meet in the corner, with letters beyond their ends. Without arrowheads: lines
// are undirected, and the corner is chosen for its visibility, not by the axes' signs.
void DrawObjectAxes(FigurePage& page, const ImageCrop& crop, const YawFigure::View& view,
                    const FigureTheme& theme) {
  const Eigen::Vector2d from = crop.ToPage(view.corner);
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector2d& end = view.ends[static_cast<std::size_t>(axis)];
    const Eigen::Vector2d to = crop.ToPage(end);
    const Eigen::Vector2d along = (to - from).normalized();
    crop.DrawLine(page, view.corner, end, {kAxisHalo, 3.4, {}});
    crop.DrawLine(page, view.corner, end, {YawAxisColor(axis), 2.0, {3.0, 1.4}});
    if (!crop.Contains(end) || (to - from).norm() < 1.0) {
      continue;
    }
    Eigen::Vector2d at = to + 0.7 * theme.font * along;
    const FigureRect& area = crop.Area();
    at.x() = std::clamp(at.x(), area.x + 0.5 * theme.font, area.Right() - 0.5 * theme.font);
    at.y() = std::clamp(at.y(), area.y + 0.6 * theme.font, area.Bottom() - 0.6 * theme.font);
    page.Text({kAxisLetters[static_cast<std::size_t>(axis)], at, theme.font, YawAxisColor(axis),
               TextAlign::kCenter, true, 0.0, kAxisHalo});
  }
}

void DrawYawPanel(FigurePage& page, const YawFigure::Object& object, const YawFigure::View& view,
                  const std::string& note, const FigureRect& panel, const FigureTheme& theme) {
  const ImageCrop crop(object.image, object.region, object.quarter_turns, panel);
  crop.Draw(page);
  DrawMatchedLines(page, crop, view);
  DrawObjectAxes(page, crop, view, theme);
  page.Label(note, {panel.Center().x(), panel.Bottom() + 0.95 * theme.small}, theme.small, theme.ink,
             panel.width);
}

std::string AngleNote(const YawFigure::Object& object, const YawFigure::View& view, const std::string& more) {
  return object.yaw_lines == 0 ? "no line tells the yaw"
                               : fmt::format("mean angle {:.1f}°, {}", view.mean_angle, more);
}

std::string LineCount(int lines) { return fmt::format("{} line{}", lines, lines == 1 ? "" : "s"); }

std::string YawText(double degrees) {
  return fmt::format("yaw {}{:.1f}°", degrees < -0.05 ? "\u2212" : "", std::abs(degrees));
}

}  // namespace

FigurePage DrawYaw(const YawFigure& figure, const FigureOptions& options) {
  ThrowIf<UsageError>(figure.objects.empty(), "no objects, expected at least one");
  for (const YawFigure::Object& object : figure.objects) {
    ThrowIf<UsageError>(object.image.empty(), "{}: no image, expected that of a frame", object.name);
  }
  FigureSheet sheet = MakeSheet(
      options, kColumnWidth, "Yaw from line segments",
      [&](double width, const FigureTheme& theme) { return LayOutYaw(figure, theme, width).Height(); });
  const FigureTheme& theme = sheet.theme;
  PanelGrid grid = LayOutYaw(figure, theme, sheet.area.width);
  grid.height += grid.Spare(sheet.area);
  ThrowIf<UsageError>(grid.height < 8.0, "the figure is too low for its images, expected a larger height");
  for (int row = 0; row < grid.rows; ++row) {
    const YawFigure::Object& object = figure.objects[static_cast<std::size_t>(row)];
    NameRow(sheet, grid, row, object.name);
    DrawYawPanel(sheet.page, object, object.before,
                 AngleNote(object, object.before, LineCount(object.yaw_lines)),
                 grid.PanelAt(sheet.area, row, 0), theme);
    DrawYawPanel(sheet.page, object, object.after, AngleNote(object, object.after, YawText(object.yaw)),
                 grid.PanelAt(sheet.area, row, 1), theme);
  }
  for (const int column : {0, 1}) {
    sheet.page.Text(column == 0 ? "(a) map's axes" : "(b) optimised",
                    {grid.PanelAt(sheet.area, 0, column).Center().x(), sheet.area.y + 0.6 * theme.font},
                    theme.font, theme.ink, TextAlign::kCenter);
  }
  const double legend = LegendHeight(YawLegend(), sheet.area.width, theme);
  DrawLegend(sheet.page, YawLegend(), {sheet.area.x, sheet.area.Bottom() - legend, sheet.area.width, legend},
             theme);
  return std::move(sheet.page);
}

}  // namespace sqslam
